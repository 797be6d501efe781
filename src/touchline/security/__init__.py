"""Identities on a secured bus: certificate authority, certificates, and the list of those who may join."""
