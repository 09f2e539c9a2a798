"""A headless Chromium, spoken to through chromedriver by WebDriver's JSON over HTTP."""
import base64
import json
import os
import re
import subprocess
import time
import urllib.error
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # WebDriver's key of an element's id
PIECE_PX = 4000  # high are screenshots of parts of a page
ARROW_RIGHT, ARROW_LEFT, END = "\ue014", "\ue012", "\ue010"


class BrowserError(RuntimeError):
    pass


class Browser:
    """Reaches no network: no name resolves. What it is asked to load is logged."""

    def __init__(self, chromium, chromedriver, folder):
        self._log = open(os.path.join(folder, "chromedriver.log"), "w+", encoding="utf-8", errors="replace")
        self._driver = subprocess.Popen([chromedriver, "--port=0"], stdout=self._log, stderr=subprocess.STDOUT)
        self._session = None
        try:
            self._url = f"http://127.0.0.1:{self._port()}"
            arguments = ["--headless=new", "--host-resolver-rules=MAP * ~NOTFOUND", "--disable-gpu",
                         "--disable-dev-shm-usage", "--disable-background-networking", "--no-first-run",
                         "--hide-scrollbars", "--force-device-scale-factor=1"]
            if os.geteuid() == 0:
                arguments.append("--no-sandbox")  # Chromium's sandbox refuses root; the pages are our own
            options = {"binary": chromium, "args": arguments}
            capabilities = {"browserName": "chrome", "goog:chromeOptions": options,
                            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}
            answer = self._post("/session", {"capabilities": {"alwaysMatch": capabilities}})
            self._session = "/session/" + answer["sessionId"]
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        try:
            if self._session:
                self._request("DELETE", self._session)
        except BrowserError:
            pass  # it is ended below, whatever it says
        self._driver.terminate()
        try:
            self._driver.wait(10)
        except subprocess.TimeoutExpired:
            self._driver.kill()
            self._driver.wait()
        self._log.close()

    def _port(self):
        """chromedriver picks a free one, and says which."""
        until = time.monotonic() + 60
        while time.monotonic() < until and self._driver.poll() is None:
            self._log.seek(0)
            found = re.search(r"started successfully on port (\d+)", self._log.read())
            if found:
                return int(found.group(1))
            time.sleep(0.05)
        self._log.seek(0)
        raise BrowserError("chromedriver did not start: " + self._log.read()[-500:])

    def _request(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._url + path, data, {"Content-Type": "application/json"}, method=method)
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=90) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise BrowserError(f"{method} {path}: {json.load(error)['value']['message']}") from error
        except OSError as error:
            raise BrowserError(f"{method} {path}: {error}") from error

    def _post(self, path, body):
        return self._request("POST", path, body)

    def devtools(self, command, **parameters):
        return self._post(self._session + "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def open(self, path):
        self._post(self._session + "/url", {"url": "file://" + os.path.abspath(path)})

    def resize(self, width, height):
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                      mobile=False)
        # Charts follow their boxes in the frames after.
        self._post(self._session + "/execute/async", {"args": [], "script":
                   "const done = arguments[0];"
                   "requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 200)));"})

    def run(self, script, *arguments):
        return self._post(self._session + "/execute/sync", {"script": script, "args": list(arguments)})

    def type(self, selector, index, keys):
        """Into one of the elements of a selector."""
        found = self._post(self._session + "/elements", {"using": "css selector", "value": selector})
        self._post(f"{self._session}/element/{found[index][ELEMENT]}/value", {"text": keys})

    def press(self, key):
        """To what has the focus."""
        actions = [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self._post(self._session + "/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def screenshots(self, stem, width):
        """Of the whole page, from its top: STEM-1.png and on. Far from its window Chromium draws no charts."""
        self.resize(width, PIECE_PX)
        height = self.devtools("Page.getLayoutMetrics")["cssContentSize"]["height"]
        for piece, top in enumerate(range(0, height, PIECE_PX)):
            self.run("scrollTo(0, arguments[0])", top)
            with open(f"{stem}-{piece + 1}.png", "wb") as out:
                out.write(self.png_of({"x": 0, "y": top, "width": width, "height": min(PIECE_PX, height - top)}))

    def png_of(self, rectangle):
        """Of a part of the page that the window shows; equal parts are equal bytes."""
        shot = self.devtools("Page.captureScreenshot", format="png", clip={**rectangle, "scale": 1})
        return base64.b64decode(shot["data"])

    def console(self):
        """What was said since it was asked last."""
        return [f"{e['level']}: {e['message']}" for e in self._post(self._session + "/se/log", {"type": "browser"})]

    def requested(self):
        """The addresses that were to be loaded since it was asked last."""
        entries = self._post(self._session + "/se/log", {"type": "performance"})
        messages = [json.loads(entry["message"])["message"] for entry in entries]
        return [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
