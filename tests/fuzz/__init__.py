"""The hostile suite: damaged and malicious input of every kind, bounded by time, repeated by its seed."""
