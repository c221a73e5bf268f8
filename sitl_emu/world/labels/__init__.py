"""The truth in other people's file formats: COCO, YOLO and GeoJSON. Pure functions."""
