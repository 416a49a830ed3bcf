#!/usr/bin/env python3
"""Draws docs/pictures/story.webp and docs/recording-example.png: the recording of the example, as the viewer plays it.

    python3 -m venv /tmp/viewer && /tmp/viewer/bin/pip install rerun-sdk==0.36.3 pillow
    /tmp/viewer/bin/python docs/pictures/story.py

The viewer runs without a screen and needs a driver for Vulkan, in software if there is no other. The pictures are stale when the
recording is another one than that whose SHA-256 is in story.sha256, which `cargo test` checks.
"""

import base64
import hashlib
import io
import json
import pathlib
import subprocess
import sys
import time

from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
RECORDING = HERE.parent.parent / "sessions/example/recording.rrd"
VIEWER = str(pathlib.Path(sys.executable).parent / "rerun")
PORT = 9907
SIZE = (1280, 800)
# Of the animation, whose pictures are 860 pixels wide to be sharp on the page.
WIDTH, FRAMES, PLAYED_MS, LAST_MS = 860, 60, 160, 4000
MOST_BYTES = 2_000_000
# A picture in one colour has a few.
FEWEST_COLOURS = 200


class Viewer:
    """A viewer without a screen, and the program that drives it."""

    def __init__(self, recording):
        options = ["--headless", "--window-size", "{}x{}".format(*SIZE), "--bind", "127.0.0.1", "--port", str(PORT)]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.viewer = subprocess.Popen([VIEWER, str(recording), *options], **quiet)
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
        self.control = subprocess.Popen([VIEWER, "viewer-mcp"], **pipes)
        client = {"name": "trupose", "version": "1"}
        self.ask("initialize", {"protocolVersion": "2024-11-05", "capabilities": {}, "clientInfo": client})
        self.tell({"jsonrpc": "2.0", "method": "notifications/initialized"})
        for _ in range(20):
            time.sleep(1)
            if not self.tool("connect", endpoint=f"http://127.0.0.1:{PORT}").get("isError"):
                return
        raise SystemExit("the viewer does not answer")

    def tell(self, message):
        self.control.stdin.write(json.dumps(message) + "\n")
        self.control.stdin.flush()

    def ask(self, method, params):
        self.tell({"jsonrpc": "2.0", "id": 1, "method": method, "params": params})
        return json.loads(self.control.stdout.readline())["result"]

    def tool(self, name, **arguments):
        return self.ask("tools/call", {"name": name, "arguments": arguments})

    def picture(self):
        content = self.tool("screenshot")["content"]
        data = next(part["data"] for part in content if part["type"] == "image")
        return Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")

    def close(self):
        for process in (self.control, self.viewer):
            process.terminate()
            process.wait()


def settled(viewer):
    """The picture when two in a row are equal: a software renderer takes its time."""
    last = None
    for _ in range(20):
        time.sleep(0.15)
        now = viewer.picture()
        if last is not None and now.tobytes() == last.tobytes():
            break
        last = now
    return now


def story(viewer):
    state = json.loads(viewer.tool("viewer_state")["content"][0]["text"])
    timelines = {line["timeline"]: line for line in state["recordings"][0]["timelines"]}
    low, high = timelines["story"]["min"], timelines["story"]["max"]
    for number in range(FRAMES):
        at = low + (high - low) * number // (FRAMES - 1)
        viewer.tool("set_time", timeline="story", time=at)
        yield settled(viewer)


def main():
    viewer = Viewer(RECORDING)
    try:
        time.sleep(3)
        frames = list(story(viewer))
    finally:
        viewer.close()
    for number, frame in enumerate(frames):
        if len(frame.getcolors(1 << 24)) < FEWEST_COLOURS:
            raise SystemExit(f"picture {number} is blank")
    frames[-1].save(HERE.parent / "recording-example.png", optimize=True)
    height = SIZE[1] * WIDTH // SIZE[0]
    small = [frame.resize((WIDTH, height), Image.Resampling.LANCZOS) for frame in frames]
    target = HERE / "story.webp"
    for quality in (80, 65, 50, 35):
        durations = [PLAYED_MS] * (FRAMES - 1) + [LAST_MS]
        small[0].save(target, save_all=True, append_images=small[1:], duration=durations, loop=0, quality=quality, method=6)
        if target.stat().st_size <= MOST_BYTES:
            break
    else:
        raise SystemExit(f"{target.stat().st_size} bytes are more than {MOST_BYTES}")
    (HERE / "story.sha256").write_text(hashlib.sha256(RECORDING.read_bytes()).hexdigest() + "\n")
    print(f"{target}: {FRAMES} pictures, {target.stat().st_size} bytes, quality {quality}")


if __name__ == "__main__":
    main()
