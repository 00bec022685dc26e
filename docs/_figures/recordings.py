"""Take a picture of a recording in rerun's own viewer, without a display.

    python docs/_figures/recordings.py out/elbow.rrd docs/images/recording.png --time 1.2

It runs `rerun --headless`, which needs a Vulkan driver; Mesa's lavapipe, on the processor alone, is one (Debian:
mesa-vulkan-drivers). The bar at the top, which belongs to the program, is cut off.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

BAR = 36  # height of the program's bar [pixels]
PATIENCE = 30.0  # seconds for the viewer to come up
COLORS = 256  # of the picture, which keeps it small


@contextlib.contextmanager
def viewer(size: str) -> Iterator[ViewerClient]:
    """A viewer without a window, at a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [
        sys.executable,
        "-m",
        "rerun_cli",
        "--headless",
        "--hide-welcome-screen",
        "--window-size",
        size,
    ]
    process = subprocess.Popen(
        [*command, "--port", str(port)], start_new_session=True, stderr=subprocess.DEVNULL
    )
    try:
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                if process.poll() is not None or time.monotonic() > deadline:
                    sys.exit("viewer: rerun --headless does not start here; does it find a Vulkan driver?")
                time.sleep(0.1)
        yield ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
    finally:
        os.killpg(process.pid, signal.SIGTERM)


def main() -> None:
    """Open the recording, wait until it is drawn, and keep the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--time", type=float, default=0.0, help="where the time cursor stands [s]")
    parser.add_argument("--size", default="1500x880", help="of the window (default %(default)s)")
    parser.add_argument(
        "--wait", type=float, default=6.0, help="seconds to load, and to draw (default %(default)s)"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, viewer(options.size) as client:
        shot = Path(folder) / "shot.png"
        client.open(str(options.recording.resolve()))
        time.sleep(options.wait)
        client.set_time("sim_time", duration=options.time, play_state="paused")
        time.sleep(options.wait)
        client.save_screenshot(str(shot))
        image = Image.open(shot).convert("RGB")
    image = image.crop((0, BAR, image.width, image.height))
    image.quantize(COLORS).save(options.picture, optimize=True)


if __name__ == "__main__":
    main()
