"""Taplo checks scenarios by camsim's JSON schema, and the language server tombi completes and explains their keys.

    schema.py SCHEMA.json SCENARIO.toml ...
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

TAPLO, TOMBI = (pathlib.Path(sys.executable).with_name(name) for name in ("taplo", "tombi"))
WRONG = {
    "an unknown key": "[camera]\nfsp = 30\n",
    "an unknown word": '[camera.shutter]\nreadout = "top-to-botom"\n',
    "a number below its range": "[camera]\nfps = 0\n",
    "a list too short": "[camera]\nsize_px = [640]\n",
    "a sensor without a name": "[[imu]]\nrate_hz = 100\n",
}
GOOD = '[flight]\nlog = "a.csv"\n[scene.terrain]\ndem = "d.tif"\n'


def lint(schema: pathlib.Path, text: str) -> bool:
    """Whether taplo accepts a scenario."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write(text)
        file.flush()
        run = subprocess.run([TAPLO, "lint", "--schema", schema.as_uri(), file.name], capture_output=True, check=False)
    return run.returncode == 0


class Server:
    """A language server over standard input and output."""

    def __init__(self) -> None:
        self.process = subprocess.Popen([TOMBI, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.number = 0

    def send(self, message: dict) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def receive(self) -> dict:
        length = 0
        while (line := self.process.stdout.readline().strip()) != b"":
            name, _, value = line.partition(b":")
            length = int(value) if name.lower() == b"content-length" else length
        return json.loads(self.process.stdout.read(length))

    def ask(self, method: str, params: dict) -> object:
        self.number += 1
        self.send({"id": self.number, "method": method, "params": params})
        while True:
            message = self.receive()
            if message.get("id") == self.number and "method" not in message:
                assert "error" not in message, message
                return message["result"]
            if "method" in message and "id" in message:
                self.send({"id": message["id"], "result": None})

    def open(self, uri: str, text: str) -> None:
        document = {"uri": uri, "languageId": "toml", "version": 1, "text": text}
        self.send({"method": "textDocument/didOpen", "params": {"textDocument": document}})

    def at(self, method: str, uri: str, line: int, character: int) -> object:
        """The answer for a position; the server may still be reading document and schema."""
        params = {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}
        for _ in range(50):
            if answer := self.ask(f"textDocument/{method}", params):
                return answer
            time.sleep(0.2)
        raise AssertionError(f"no {method} for {uri}")


def labels(completions: object) -> list[str]:
    items = completions["items"] if isinstance(completions, dict) else completions or []
    return [item["label"].strip('"') for item in items]


def main() -> None:
    schema, *scenarios = (pathlib.Path(name).resolve() for name in sys.argv[1:])
    for scenario in scenarios:
        assert lint(schema, scenario.read_text()), f"{scenario} is refused"
    assert lint(schema, GOOD)
    for what, text in WRONG.items():
        assert not lint(schema, GOOD + text), f"{what} is accepted"
    with tempfile.TemporaryDirectory() as folder:
        server, root = Server(), pathlib.Path(folder)
        server.ask("initialize", {"processId": None, "rootUri": root.as_uri(), "capabilities": {}})
        server.send({"method": "initialized", "params": {}})
        head = f"#:schema {schema.as_uri()}\n{GOOD}[camera.shutter]\n"
        texts = {"keys": "r\n", "words": 'readout = ""\n', "meaning": "exposure_ms = 4\n"}
        at = head.count("\n")
        uris = {name: (root / f"{name}.toml").as_uri() for name in texts}
        for name, text in texts.items():
            (root / f"{name}.toml").write_text(head + text)
            server.open(uris[name], head + text)
        keys = labels(server.at("completion", uris["keys"], at, 1))
        assert "readout_ms" in keys, keys
        words = labels(server.at("completion", uris["words"], at, 11))
        assert "bottom-to-top" in words, words
        meaning = json.dumps(server.at("hover", uris["meaning"], at, 3))
        assert "Exposure time" in meaning, meaning
        server.process.kill()
    print(f"taplo accepts {len(scenarios)} scenarios, refuses {len(WRONG)} mistakes; tombi completes keys and words, and shows meanings")


if __name__ == "__main__":
    main()
