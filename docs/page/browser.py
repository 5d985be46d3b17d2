"""A client of Chromium's DevTools protocol over pipes, with Python's own library alone."""
import base64
import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading
import time


class Browser:
    """Chromium without a window, on its software renderer, with one tab."""

    def __init__(self, program, width=1280, height=900):
        self.profile = tempfile.mkdtemp(prefix="relight-page-")
        ours, theirs = os.pipe(), os.pipe()  # we write, they read; they write, we read
        command = [program, "--headless=new", "--remote-debugging-pipe", f"--user-data-dir={self.profile}",
                   f"--window-size={width},{height}", "--no-first-run", "--disable-extensions", "--hide-scrollbars",
                   "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--mute-audio"]
        command += ["--no-sandbox"] if os.geteuid() == 0 else []  # Chromium refuses its sandbox to root

        def ends():
            read, write = os.dup(ours[0]), os.dup(theirs[1])
            os.dup2(read, 3)
            os.dup2(write, 4)

        self.process = subprocess.Popen(command + ["about:blank"], preexec_fn=ends, pass_fds=(3, 4), close_fds=True,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(ours[0])
        os.close(theirs[1])
        self.sink, self.source = os.fdopen(ours[1], "wb", 0), os.fdopen(theirs[0], "rb", 0)
        self.answers, self.errors, self.requests, self.number, self.session = queue.Queue(), [], [], 0, None
        threading.Thread(target=self.listen, daemon=True).start()
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.call(f"{domain}.enable")

    def listen(self):
        pending = b""
        while chunk := self.source.read(1 << 16):
            *messages, pending = (pending + chunk).split(b"\0")
            for message in map(json.loads, messages):
                self.answers.put(message) if "id" in message else self.event(message["method"], message["params"])

    def event(self, method, about):
        if method == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in about["args"]))
        elif method == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(f"{about['entry']['text']} {about['entry'].get('url', '')}")
        elif method == "Network.requestWillBeSent":
            self.requests.append(about["request"]["url"])

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.sink.write(json.dumps(message).encode() + b"\0")
        answer = self.answers.get(timeout=120)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def run(self, expression):
        """The value of an expression, awaited if it is a promise."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"].get("exception", {}).get("description", expression))
        return answer["result"].get("value")

    def wait(self, expression, seconds=60):
        """Whether an expression becomes true."""
        end = time.time() + seconds
        while time.time() < end:
            if self.run(expression):
                return True
            time.sleep(0.1)
        return False

    def open(self, address):
        self.call("Page.navigate", url=address)
        return self.wait(f"location.href.startsWith({json.dumps(address)}) && document.readyState === 'complete'")

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)

    def scheme(self, name):
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])

    def press(self, key, code=None, seconds=0.0):
        about = {"key": key, "code": code or key, "windowsVirtualKeyCode": {"ArrowRight": 39, "ArrowLeft": 37}.get(key, ord(key[0].upper()))}
        self.call("Input.dispatchKeyEvent", type="rawKeyDown", **about)
        time.sleep(seconds)
        self.call("Input.dispatchKeyEvent", type="keyUp", **about)

    def drag(self, start, end):
        """From one point of the window to another with the left button; a click where both are equal."""
        for kind, (x, y), buttons in [("mouseMoved", start, 0), ("mousePressed", start, 1), ("mouseMoved", end, 1), ("mouseReleased", end, 0)]:
            button = "none" if kind == "mouseMoved" and not buttons else "left"
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=buttons, clickCount=1)

    def touch(self, start, end):
        """A finger from one point to another."""
        self.call("Emulation.setTouchEmulationEnabled", enabled=True)
        for kind, points in [("touchStart", [start]), ("touchMove", [end]), ("touchEnd", [])]:
            self.call("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y} for x, y in points])
        self.call("Emulation.setTouchEmulationEnabled", enabled=False)

    def middle(self, selector, part=0.5):
        """The point at a part of an element's width and in the middle of its height, after scrolling to it."""
        return self.run(f"""(() => {{ const e = document.querySelector({json.dumps(selector)});
            e.scrollIntoView({{ block: "center", behavior: "instant" }}); const b = e.getBoundingClientRect();
            return [b.left + b.width * {part}, b.top + b.height / 2]; }})()""")

    def picture(self, path, whole=False):
        made = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole,
                         **({"clip": self.whole()} if whole else {}))
        with open(path, "wb") as file:
            file.write(base64.b64decode(made["data"]))

    def whole(self):
        size = self.call("Page.getLayoutMetrics")["cssContentSize"]
        return {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
        except (OSError, RuntimeError, queue.Empty):
            self.process.kill()
        self.process.wait(20)
        shutil.rmtree(self.profile, ignore_errors=True)
