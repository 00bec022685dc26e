from .installing import install as install
from .installing import load as load
from .muscles import Muscles as Muscles
from .native import native as native
from .readout import Readout as Readout
from .readout import excitations as excitations
from .readout import read as read
from .registering import register as register
