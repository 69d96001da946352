"""The waist of the hourglass: what an app is, whichever host runs it.

Below are cores and formats that know no app; above are apps, side by side, that know no host.
"""

from pymoos_lite.app.base import App, AppContext, Connection, Quit
from pymoos_lite.app.network import Address, Bundle, DatagramPort, Datagrams, Network, Payload
from pymoos_lite.app.runner import AppRunner
from pymoos_lite.app.standard import STANDARD_PARAMETERS

__all__ = [
    "STANDARD_PARAMETERS",
    "Address",
    "App",
    "AppContext",
    "AppRunner",
    "Bundle",
    "Connection",
    "DatagramPort",
    "Datagrams",
    "Network",
    "Payload",
    "Quit",
]
