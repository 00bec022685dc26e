"""Wraps of one obstacle between two given points: closed forms, searches, and ends on or inside the surface."""
