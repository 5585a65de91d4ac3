"""Measured curves: how they are read, confirmed, drawn, fitted and reconstructed."""
