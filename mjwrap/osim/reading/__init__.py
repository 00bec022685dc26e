"""Read .osim files of all versions from 2.0 on, without OpenSim."""

from mjwrap.osim.reading.model import read_osim as read_osim
