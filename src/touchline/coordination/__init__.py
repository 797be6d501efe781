"""Teams of robots that keep out of each other's path: cells, deployment, lossy links."""
