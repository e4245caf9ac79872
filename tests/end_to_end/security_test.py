"""TLS, client certificates, tokens and roles, as shapectl and a Python client meet them."""

import contextlib
import json
import os
import pathlib
import re
import shutil
import ssl
import socket
import subprocess
import tempfile
import threading
import time
import unittest

import grpc

from certificates import Authority
from support import BAD_INPUT, BINARIES, NOT_FOUND, SUCCESS, UNAVAILABLE, Daemon, Result, tube, write_mesh, write_tubes

DENIED = 8


def eventually(question, seconds=10):
    """Asks until the answer is true; the last answer."""
    until = time.monotonic() + seconds
    while not (answer := question()) and time.monotonic() < until:
        time.sleep(0.1)
    return answer


def shapectl(address, *words, **environment):
    """Runs shapectl with --output json; variables of the environment come by name."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("SHAPED_")}
    return Result(subprocess.run([BINARIES / "shapectl", "--output", "json", "--server", address, *map(str, words)],
                                 env={**clean, **environment}, capture_output=True, text=True, timeout=120))


def make_token(name, roles, *words):
    """(token, entry of a tokens file), from `shapectl token`."""
    made = shapectl("localhost:1", "token", name, "--roles", roles, *words).json
    return made["token"], made["entry"]


def replace(path, text):
    """As an operator should do it: the new file appears whole."""
    new = path.with_suffix(".new")
    new.write_text(text)
    new.rename(path)


class SecurityCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.ours, cls.theirs = Authority(cls.folder, "ours"), Authority(cls.folder, "theirs")
        cls.certificate, cls.key = cls.ours.sign("daemon")

    @contextlib.contextmanager
    def daemon(self, *options, certificate=None, key=None):
        """A daemon over TLS and its address by name, since certificates are for names."""
        with tempfile.TemporaryDirectory() as store:
            daemon = Daemon(store, "--tls-cert", certificate or self.certificate, "--tls-key", key or self.key, *options)
            try:
                self.log = None
                yield "localhost:" + daemon.address.rsplit(":", 1)[1]
                self.assertTrue(daemon.running(), "the daemon has died")
            finally:
                self.log = daemon.stop()[1]

    def expect(self, code, text, *words, **environment):
        result = shapectl(*words, **environment)
        self.assertEqual(result.code, code, result.out + result.err)
        if text:
            self.assertIn(text, result.message())
        return result

    def trusted(self):
        return ("--ca", self.ours.certificate)


class Transport(SecurityCase):
    def test_tls_and_what_its_failures_say(self):
        with self.daemon() as address:
            self.expect(SUCCESS, "", address, "models", *self.trusted())
            self.expect(SUCCESS, "", address, "models", SHAPED_CA=str(self.ours.certificate))
            self.expect(UNAVAILABLE, "the daemon wants TLS; add --tls", address, "models")
            self.expect(UNAVAILABLE, "is not trusted", address, "models", "--ca", self.theirs.certificate)
            self.expect(UNAVAILABLE, "is not trusted", address, "models", "--tls")
            self.expect(BAD_INPUT, "nowhere.pem", address, "models", "--ca", "nowhere.pem")
            self.expect(BAD_INPUT, "--key: is missing", address, "models", "--cert", self.certificate)
        with self.daemon(certificate=self.ours.sign("far", "DNS:far.example")[0], key=self.folder / "far.key") as address:
            self.expect(UNAVAILABLE, 'for other names than "localhost"', address, "models", *self.trusted())

    def test_replicas_show_a_certificate_for_the_first_name(self):
        certificate, key = self.ours.sign("named", "DNS:localhost")
        with self.daemon(certificate=certificate, key=key) as one, self.daemon(certificate=certificate, key=key) as two:
            other = two.replace("localhost", "127.0.0.1")
            for _ in range(4):
                self.expect(SUCCESS, "", f"{one},{other}", "models", *self.trusted())
            self.expect(UNAVAILABLE, "", f"{other},{one}", "models", *self.trusted())

    def test_a_daemon_in_the_clear_says_so_to_a_client_with_tls(self):
        with tempfile.TemporaryDirectory() as store:
            daemon = Daemon(store)
            self.addCleanup(daemon.stop)
            self.expect(UNAVAILABLE, "does not speak TLS", daemon.address, "models", *self.trusted())
            self.expect(SUCCESS, "", daemon.address, "models")

    def test_old_protocols_are_refused(self):
        with self.daemon() as address:
            for version, accepted in ((ssl.TLSVersion.TLSv1_1, False), (ssl.TLSVersion.TLSv1_2, True),
                                      (ssl.TLSVersion.TLSv1_3, True)):
                context = ssl.create_default_context(cafile=self.ours.certificate)
                context.set_ciphers("ALL:@SECLEVEL=0")
                context.set_alpn_protocols(["h2"])
                context.maximum_version = context.minimum_version = version
                host, port = address.split(":")
                with socket.create_connection((host, int(port)), 5) as plain:
                    if accepted:
                        context.wrap_socket(plain, server_hostname=host).close()
                    else:
                        with self.assertRaises(ssl.SSLError):
                            context.wrap_socket(plain, server_hostname=host)

    def test_faulty_files_are_refused_at_start(self):
        expired, its_key = self.ours.sign("expired", days=-1)
        for words, text in (((expired, its_key), "--tls-cert: .*expired.crt has expired on"),
                            ((self.certificate, its_key), "--tls-key: .* is not the key of the first certificate"),
                            ((self.key, self.key), "--tls-cert: .* holds no certificate"),
                            ((self.certificate, self.certificate), "--tls-key: .* holds no private key"),
                            ((self.folder / "none", self.key), "--tls-cert: .*none: cannot be opened")):
            with self.assertRaisesRegex(RuntimeError, "shaped ended with 2.*" + text):
                Daemon(self.folder / "store", "--tls-cert", words[0], "--tls-key", words[1])

    def test_an_expired_certificate_is_recognised(self):
        """The daemon started while it was good: a client sees why it is refused."""
        # A certificate of another clock: signed as expired, served by a plain TLS server in the daemon's place.
        expired, key = self.ours.sign("late", days=-1)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(expired, key)
        context.set_alpn_protocols(["h2"])
        server = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(server.close)

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    with contextlib.suppress(ssl.SSLError, ConnectionError):
                        context.wrap_socket(server.accept()[0], server_side=True).close()

        threading.Thread(target=serve, daemon=True).start()
        self.expect(UNAVAILABLE, "certificate has expired", f"127.0.0.1:{server.getsockname()[1]}", "models",
                    *self.trusted())

    def test_without_tls_only_the_loopback_is_served(self):
        with self.assertRaisesRegex(RuntimeError, "0.0.0.0:0 can be reached from other machines"):
            Daemon(self.folder / "store", "--listen", "0.0.0.0:0")
        daemon = Daemon(self.folder / "store", "--listen-insecurely", "0.0.0.0:0")
        self.addCleanup(daemon.stop)
        self.expect(SUCCESS, "", "127.0.0.1:" + daemon.address.rsplit(":", 1)[1], "models")


class ClientCertificates(SecurityCase):
    def test_only_certificates_of_the_authority_are_served(self):
        mine, others, late = self.ours.sign("farm"), self.theirs.sign("stranger"), self.ours.sign("late", days=-1)
        with self.daemon("--tls-client-ca", self.ours.certificate) as address:
            self.expect(UNAVAILABLE, "only clients with a certificate", address, "models", *self.trusted())
            self.expect(SUCCESS, "", address, "models", *self.trusted(), "--cert", mine[0], "--key", mine[1])
            self.expect(UNAVAILABLE, "refuses your certificate", address, "models", *self.trusted(),
                        "--cert", others[0], "--key", others[1])
            self.expect(UNAVAILABLE, "refuses your certificate", address, "models", *self.trusted(), "--cert", late[0], "--key", late[1])
        self.assertIn("method=Models.List client=farm", self.log)

    def test_the_tokens_file_gives_certificates_their_roles(self):
        farm, barn = self.ours.sign("farm2"), self.ours.sign("barn")
        tokens = self.folder / "certificate_roles.json"
        tokens.write_text(json.dumps({"certificates": {"farm2": ["read"]}}))
        with self.daemon("--tls-client-ca", self.ours.certificate, "--tokens", tokens) as address:
            as_farm = (*self.trusted(), "--cert", farm[0], "--key", farm[1])
            self.expect(SUCCESS, "", address, "models", *as_farm)
            self.expect(DENIED, 'needs the role "admin", which "farm2" does not have', address, "delete", "m", *as_farm)
            self.expect(DENIED, "known clients only", address, "models", *self.trusted(), "--cert", barn[0], "--key", barn[1])


class Rotation(SecurityCase):
    def served(self, address):
        """The common name of the certificate that a new connection meets."""
        pem = ssl.get_server_certificate(tuple(address.split(":")), ca_certs=None)
        text = subprocess.run(["openssl", "x509", "-noout", "-subject"], input=pem, text=True, capture_output=True).stdout
        return re.search(r"CN = (\S+)", text).group(1)

    def test_new_connections_meet_the_new_certificate_and_calls_go_on(self):
        certificate, key = self.folder / "now.crt", self.folder / "now.key"
        old, new, late = self.ours.sign("old"), self.ours.sign("new"), self.ours.sign("later", days=-1)
        shutil.copy(old[0], certificate), shutil.copy(old[1], key)
        with self.daemon(certificate=certificate, key=key) as address:
            self.assertEqual(self.served(address), "old")
            meshes = [write_mesh(self.folder / f"{name}.obj", *tube(angle, 0.3, 60, 24)) for name, angle in
                      (("a", 0), ("b", 1.5))]
            running = subprocess.Popen([BINARIES / "shapectl", "--server", address, *map(str, self.trusted()),
                                        "interpolate", *meshes, "--frames", "10000"], stdout=subprocess.DEVNULL)
            self.addCleanup(running.wait)
            self.addCleanup(running.kill)
            time.sleep(0.5)
            # The key first: for a while, the two do not belong together.
            replace(key, new[1].read_text())
            time.sleep(3)
            self.assertEqual(self.served(address), "old")
            self.expect(SUCCESS, "", address, "models", *self.trusted())
            certificate.write_text(new[0].read_text()[:200])
            time.sleep(3)
            self.assertEqual(self.served(address), "old")
            replace(certificate, new[0].read_text())
            self.assertTrue(eventually(lambda: self.served(address) == "new"))
            self.expect(SUCCESS, "", address, "models", *self.trusted())
            replace(key, late[1].read_text()), replace(certificate, late[0].read_text())
            time.sleep(3)
            self.assertEqual(self.served(address), "new")
            self.assertIsNone(running.poll(), "the call in flight has ended")
        for text in ("is not the key of the first certificate", "holds no certificate", "has expired on",
                     'certificate \\"new\\"'):
            self.assertIn(text, self.log)


class Tokens(SecurityCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tokens, entries = {}, []
        for role in ("read", "infer", "train", "admin"):
            cls.tokens[role], entry = make_token(role + "er", role)
            entries.append(entry)
        cls.tokens["expired"], entry = make_token("expired", "admin", "--days", 1)
        entries.append({**entry, "expires": "2020-01-01T00:00:00Z"})
        cls.file = cls.folder / "tokens.json"
        cls.file.write_text(json.dumps({"tokens": entries}))

    def test_each_role_may_do_its_part(self):
        meshes = write_tubes(self.folder, 3)
        with self.daemon("--tokens", self.file) as address:
            def run(role, code, *words):
                return self.expect(code, "", address, *words, *self.trusted(), SHAPED_TOKEN=self.tokens[role])

            train = ("train", "shell-pga", "tubes", *meshes, "--coarse-vertices", 60)
            project = ("project", "tubes", meshes[0])
            run("read", DENIED, *train), run("infer", DENIED, *train), run("train", SUCCESS, *train)
            for role in ("read", "infer", "train", "admin"):
                run(role, SUCCESS, "models")
            run("read", DENIED, *project), run("train", DENIED, *project)
            run("infer", SUCCESS, *project), run("admin", SUCCESS, *project)
            self.assert_each_ends_what_he_may_start(run, train)
            for role in ("read", "infer", "train"):
                denied = run(role, DENIED, "delete", "tubes")
                self.assertIn(f'Models.Delete needs the role "admin", which "{role}er"', denied.message())
                self.assertEqual(denied.json["error"]["kind"], "denied")
            run("admin", SUCCESS, "delete", "tubes"), run("admin", NOT_FOUND, "delete", "tubes")
        self.assertIn("method=Models.Delete client=adminer", self.log)
        for token in self.tokens.values():
            self.assertNotIn(token, self.log)

    def assert_each_ends_what_he_may_start(self, run, train):
        training = run("train", SUCCESS, *train, "--detach").json["id"]
        answering = run("infer", SUCCESS, "evaluate", "tubes", "--detach").json["id"]
        run("read", DENIED, "cancel", answering), run("infer", SUCCESS, "cancel", answering)
        denied = run("infer", DENIED, "cancel", training).json["error"]
        self.assertEqual(denied["reason"], "NOT_ALLOWED")
        run("train", SUCCESS, "cancel", training), run("admin", SUCCESS, "cancel", training)
        counted = run("admin", SUCCESS, "top", "--count", 1).json["denials"]
        self.assertEqual(counted["UNAUTHENTICATED"], 0)
        self.assertGreaterEqual(counted["PERMISSION_DENIED"], 5)

    def test_unknown_and_expired_tokens_are_refused_alike(self):
        with self.daemon("--tokens", self.file) as address:
            messages = {self.expect(DENIED, "known clients only", address, "models", *self.trusted(), **environment).message()
                        for environment in ({}, {"SHAPED_TOKEN": "wrong"}, {"SHAPED_TOKEN": self.tokens["expired"]})}
            self.assertEqual(len(messages), 1)
            file = self.folder / "token"
            file.write_text(self.tokens["read"] + "\n")
            self.expect(SUCCESS, "", address, "models", *self.trusted(), "--token-file", file)
            self.expect(BAD_INPUT, "holds no token", address, "models", *self.trusted(), SHAPED_TOKEN="two words")

    def test_the_file_is_read_anew(self):
        file = self.folder / "changing.json"
        one, two = make_token("one", "read"), make_token("two", "read")
        file.write_text(json.dumps({"tokens": [one[1]]}))
        with self.daemon("--tokens", file) as address:
            def code(token):
                return shapectl(address, "models", *self.trusted(), SHAPED_TOKEN=token[0]).code

            self.assertEqual((code(one), code(two)), (SUCCESS, DENIED))
            replace(file, '{"tokens": [')
            time.sleep(3)
            self.assertEqual((code(one), code(two)), (SUCCESS, DENIED))
            replace(file, json.dumps({"tokens": [two[1]]}))
            self.assertTrue(eventually(lambda: code(two) == SUCCESS))
            self.assertEqual(code(one), DENIED)
        self.assertIn("the tokens in force stay: --tokens: ", self.log)

    def test_tokens_work_on_the_loopback_and_are_kept_from_the_network(self):
        with tempfile.TemporaryDirectory() as store:
            daemon = Daemon(store, "--tokens", self.file)
            self.addCleanup(daemon.stop)
            self.expect(SUCCESS, "", daemon.address, "models", SHAPED_TOKEN=self.tokens["read"])
            self.expect(DENIED, "", daemon.address, "models")
        self.expect(BAD_INPUT, "in the clear", "192.0.2.1:50051", "models", SHAPED_TOKEN=self.tokens["read"])

    def test_health_is_open_and_reflection_is_not(self):
        with self.daemon("--tokens", self.file) as address:
            credentials = grpc.ssl_channel_credentials(self.ours.certificate.read_bytes())
            with grpc.secure_channel(address, credentials) as channel:
                health = channel.unary_unary("/grpc.health.v1.Health/Check", bytes, bytes)
                self.assertEqual(health(b"", timeout=10), b"\x08\x01")
                reflection = channel.stream_stream("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                                   bytes, bytes)
                with self.assertRaises(grpc.RpcError) as refused:
                    next(reflection(iter([b"\x3a\x00"]), timeout=10))
                self.assertEqual(refused.exception.code(), grpc.StatusCode.UNAUTHENTICATED)
                known = (("authorization", "Bearer " + self.tokens["read"]),)
                self.assertIn(b"shaped.v1.Models", next(reflection(iter([b"\x3a\x00"]), timeout=10, metadata=known)))
                with self.assertRaises(grpc.RpcError) as refused:
                    channel.unary_unary("/shaped.v1.Models/NoSuch", bytes, bytes)(b"", timeout=10, metadata=known)
                self.assertEqual(refused.exception.code(), grpc.StatusCode.PERMISSION_DENIED)


if __name__ == "__main__":
    unittest.main()
