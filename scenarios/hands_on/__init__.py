"""Hands-on scenes: a hand leads the shaft through its port, and the admittance keeps it out of forbidden regions."""
