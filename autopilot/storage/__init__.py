"""What is kept from flight to flight: the folder of an instance, plans, and what FTP shows (PX4: rootfs, dataman)."""
