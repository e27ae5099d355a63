"""Force conditioning: what hangs on the sensor, found from static postures, and taken away."""
