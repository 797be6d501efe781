"""The public Python interface: what `import touchline` offers, over the rooms that do the work."""
