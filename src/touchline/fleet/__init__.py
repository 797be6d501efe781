"""Teams of robots that keep out of each other's way: cells, deployment, lossy links."""
