#!/usr/bin/env python3
"""vkrun weights get and vkrun priors get from a server of this machine: download_test.py VKRUN FOLDER

The server speaks TLS with a certificate made here, which CURL_CA_BUNDLE makes curl trust. SPLAT_MIRROR leads
published weights to it; a preset of our own has its address and the hash of what it sends.
"""

import fcntl
import hashlib
import http.server
import json
import os
import pathlib
import resource
import shutil
import ssl
import subprocess
import sys
import threading
import unittest

VKRUN, FOLDER = map(pathlib.Path, sys.argv[1:3])
DATA = bytes(range(256)) * 1000
HASH = hashlib.sha256(DATA).hexdigest()


class Handler(http.server.BaseHTTPRequestHandler):
    """The first folder of an address says how its file is sent; SEEN has the requests."""

    seen = []

    def do_GET(self):
        kind = self.path.split("/")[1]
        asked = self.headers.get("Range")
        Handler.seen.append((self.path, asked))
        to = {"plain": self.server.plain, "on": self.server.address + "/whole"}.get(kind)
        if to:
            self.send_response(302)
            self.send_header("Location", f"{to}/{self.path.split('/')[-1]}")
            self.end_headers()
            return
        if kind == "none":
            self.send_error(404)
            return
        data = DATA[:-1] + b"?" if kind == "damaged" else DATA
        start = int(asked[len("bytes="):-1]) if asked and kind != "ignores" else 0
        if start >= len(data):
            self.send_error(416)
            return
        self.send_response(206 if start else 200)
        if start:
            self.send_header("Content-Range", f"bytes {start}-{len(data) - 1}/{len(data)}")
        self.send_header("Content-Length", str(len(data) - start))
        self.end_headers()
        broken = kind == "breaks" and not asked
        self.wfile.write(data[start:len(data) // 2 if broken else None])
        self.close_connection = True

    def log_message(self, *_):
        pass


def serve(context=None):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    if context:
        server.socket = context.wrap_socket(server.socket, server_side=True)
    server.address = f"http{'s' if context else ''}://127.0.0.1:{server.server_address[1]}"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def start_servers():
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                    "-days", "2", "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout",
                    FOLDER / "key.pem", "-out", FOLDER / "cert.pem"], check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(FOLDER / "cert.pem", FOLDER / "key.pem")
    server = serve(context)
    server.plain = serve().address
    return server


def vkrun(status, *words, most=None, **environment):
    """What it says, on a disk that takes files of `most` bytes."""
    clean = {name: value for name, value in os.environ.items() if "proxy" not in name.lower()}
    own = {"CURL_CA_BUNDLE": FOLDER / "cert.pem", "CURL_HOME": FOLDER, "SPLAT_PRIORS_DIR": FOLDER / "models"}
    limit = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))) if most else None
    done = subprocess.run([VKRUN, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env=clean | own | environment, check=False, preexec_fn=limit)
    if done.returncode != status:
        raise AssertionError(f"{words} ended with {done.returncode}, expected {status}: {done.stdout} {done.stderr}")
    return done.stdout + done.stderr


class Download(unittest.TestCase):
    def setUp(self):
        Handler.seen.clear()
        self.folder = FOLDER / self.id().split(".")[-1]
        self.folder.mkdir()
        self.file = self.folder / "net.onnx"
        self.part = self.folder / "net.onnx.part"

    def get(self, kind, status=0, sha256=HASH, size=len(DATA), url=None, **rest):
        """Fetch what a preset names."""
        preset = json.loads(vkrun(0, "priors", "where", "u2net", "--json"))["preset"]
        preset["file"] = {"name": "net.onnx", "url": url or f"{SERVER.address}/{kind}/net.onnx"}
        preset["file"] |= ({"sha256": sha256} if sha256 else {}) | ({"bytes": size} if size else {})
        return vkrun(status, "priors", "get", json.dumps(preset), "--out", self.folder, **rest)

    def expect(self, said, *parts):
        for part in parts:
            self.assertIn(str(part), said)

    def test_whole_file_is_fetched_once(self):
        self.expect(self.get("whole"), f"{self.file}: 250 KiB, its SHA-256 is the known one\nlicence: ")
        self.assertEqual(self.file.read_bytes(), DATA)
        self.assertFalse(self.part.exists())
        self.expect(self.get("whole"), f"{self.file}: there already, ")
        self.assertEqual(len(Handler.seen), 1)
        self.file.write_bytes(b"other")
        self.expect(self.get("whole", status=4), "is there with SHA-256 ", f", expected {HASH}", "--out")
        self.assertEqual(self.file.read_bytes(), b"other")

    def test_redirect_is_followed_over_https_only(self):
        self.get("on")
        self.assertEqual(self.file.read_bytes(), DATA)
        self.file.unlink()
        self.expect(self.get("plain", status=1), f"'{SERVER.address}/plain/net.onnx' broke off: status 1 of curl")
        self.assertEqual(list(self.folder.iterdir()), [])
        self.expect(self.get("", status=2, url=SERVER.plain + "/whole/net.onnx"), "starts with https://")
        self.expect(self.get("", status=1, url="https://127.0.0.1:1/net.onnx"), "status 7 of curl")

    def test_what_breaks_off_goes_on(self):
        half = len(DATA) // 2
        self.expect(self.get("breaks", status=1), "broke off: status ",
                    f"{half} bytes of {len(DATA)} are kept in '{self.part}': the same command goes on with them")
        self.assertEqual(self.part.read_bytes(), DATA[:half])
        self.get("breaks")
        self.assertEqual(Handler.seen[1][1], f"bytes={half}-")
        self.assertEqual(self.file.read_bytes(), DATA)

    def test_whole_part_only_needs_its_check(self):
        self.part.write_bytes(DATA)
        self.get("none")
        self.assertEqual(Handler.seen, [])
        self.assertEqual(self.file.read_bytes(), DATA)
        self.file.unlink()
        self.part.write_bytes(DATA + b"of another file")
        self.get("whole")
        self.assertEqual(Handler.seen, [("/whole/net.onnx", None)])

    def test_server_that_cannot_go_on_starts_again(self):
        self.part.write_bytes(b"begun")
        self.expect(self.get("ignores"), "the server cannot go on with", "starts again")
        self.assertEqual([asked for _, asked in Handler.seen], ["bytes=5-", None])
        self.assertEqual(self.file.read_bytes(), DATA)

    def test_wrong_file_is_deleted(self):
        self.expect(self.get("damaged", status=4), "256000 bytes from", f"expected {HASH}", "are deleted")
        self.assertEqual(list(self.folder.iterdir()), [])
        self.part.write_bytes(b"damage")
        self.get("whole", status=4)
        self.get("whole")
        self.assertEqual(self.file.read_bytes(), DATA)

    def test_refused_address_is_named(self):
        self.expect(self.get("none", status=1), "404", f"the server refuses '{SERVER.address}/none/net.onnx'")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_full_disk_keeps_what_is_there(self):
        self.expect(self.get("whole", status=1, most=100000), f"cannot write '{self.part}' any further", "free there",
                    "are kept")
        self.assertGreater(self.part.stat().st_size, 0)
        self.get("whole")
        self.assertEqual(self.file.read_bytes(), DATA)
        self.file.unlink()
        self.expect(self.get("whole", status=1, size=10**15), f"no room for '{self.file}': ", "are missing")

    def test_two_downloads_do_not_mix(self):
        with open(self.part, "wb") as held:
            fcntl.flock(held, fcntl.LOCK_EX)
            self.expect(self.get("whole", status=1), "is being written by another download")
        self.assertEqual(Handler.seen, [])

    def test_without_curl_the_commands_are_printed(self):
        said = self.get("whole", status=1, PATH="/nonexistent")
        self.expect(said, "cannot start curl (No such file or directory): install it", "--proto =https")
        commands = said[said.index("  mkdir"):]
        subprocess.run(["sh", "-c", commands], check=True, capture_output=True,
                       env=os.environ | {"CURL_CA_BUNDLE": FOLDER / "cert.pem", "NO_PROXY": "127.0.0.1"})
        self.assertEqual(self.file.read_bytes(), DATA)

    def test_unknown_hash_needs_consent(self):
        self.expect(self.get("whole", status=2, sha256=None), "the SHA-256 of 'net.onnx' is not known", "--unverified")
        mirror = {"SPLAT_MIRROR": SERVER.address + "/whole/"}
        self.expect(vkrun(2, "weights", "get", "chairs", "--out", self.folder, **mirror), "--unverified")
        said = vkrun(0, "weights", "get", "chairs", "--unverified", "--out", self.folder, "--json", **mirror)
        self.assertEqual(json.loads(said), {
            "file": str(self.folder / "model_chairs.pth"), "address": SERVER.address + "/whole/model_chairs.pth",
            "bytes": len(DATA), "sha256": HASH, "verified": False, "was_there": False})
        self.expect(vkrun(0, "weights", "get", "chairs", "--unverified", "--out", self.folder, **mirror),
                    f"there already, 250 KiB, not verified, SHA-256 {HASH}")

    def test_mirror_has_the_published_hashes(self):
        mirror = {"SPLAT_MIRROR": SERVER.address + "/whole"}
        self.expect(vkrun(4, "weights", "get", "cars", "--out", f"{self.folder}/", **mirror), "expected 5f604bbab8dae0")
        self.assertEqual(list(self.folder.iterdir()), [])
        self.expect(vkrun(1, "priors", "get", "midas-small", **mirror), "256000 bytes of 66764249 are kept")
        self.expect(vkrun(4, "priors", "get", "midas-small", **mirror), "expected 2d8c6cb8f415229d", "are deleted")
        self.assertEqual(Handler.seen, [("/whole/model_cars.pth", None), ("/whole/model-small.onnx", None),
                                        ("/whole/model-small.onnx", "bytes=256000-")])
        self.expect(vkrun(2, "weights", "get", "cars", SPLAT_MIRROR=SERVER.plain), "SPLAT_MIRROR is 'http:")

    def test_unknown_names_are_refused(self):
        self.expect(vkrun(2, "weights", "get", "chair"), "no published weights 'chair'; did you mean 'chairs'?")
        self.expect(vkrun(2, "weights", "get", "aeroplanes"), "there are: cars, chairs, hydrants, teddybears, nmr, obj")
        self.expect(vkrun(4, "priors", "get", "u3net"), "did you mean 'u2net'?")
        self.expect(vkrun(4, "priors", "get", "isnet-imgly"), "no address of 'isnet-imgly.onnx' is known; Get it by")
        preset = json.loads(vkrun(0, "priors", "where", "u2net", "--json"))["preset"]
        preset["file"]["name"] = "../net.onnx"
        self.expect(vkrun(4, "priors", "get", json.dumps(preset)), "'../net.onnx', expected the name of a file")


missing = [program for program in ("curl", "openssl") if not shutil.which(program)]
if missing:
    print(f"skipped: install {' and '.join(missing)}")
    sys.exit(77)
SERVER = start_servers()
unittest.main(argv=sys.argv[:1])
