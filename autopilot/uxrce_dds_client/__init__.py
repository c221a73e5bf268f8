"""The uXRCE-DDS client: topics as ROS 2 hears and tells them (PX4: src/modules/uxrce_dds_client)."""
