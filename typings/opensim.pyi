# A wheel for some platforms only, used by one benchmark where it is installed.
from typing import Any

def __getattr__(name: str) -> Any: ...
