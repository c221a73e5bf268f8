"""What every companion has: connection, camera, detector, geolocation, peer link."""
