"""The disaster mission: a UAS scans an area, finds water, ruins or fire, and drops a parcel at their edge."""
