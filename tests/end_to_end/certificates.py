"""Authorities and certificates for the tests, made by the openssl command."""

import subprocess


def openssl(folder, *words, text=None):
    subprocess.run(["openssl", *map(str, words)], cwd=folder, input=text, text=True, check=True, capture_output=True)


class Authority:
    """A certificate authority with its files in a folder: NAME.crt, NAME.key."""

    def __init__(self, folder, name):
        self.folder, self.name = folder, name
        self.certificate = folder / f"{name}.crt"
        openssl(folder, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                "-keyout", f"{name}.key", "-out", f"{name}.crt", "-days", 30, "-subj", f"/CN={name}")

    def sign(self, name, names="DNS:localhost,IP:127.0.0.1", days=30):
        """A certificate for NAME as (certificate, key); days < 0: it has expired."""
        certificate, key, request, extensions = (self.folder / f"{name}.{end}" for end in ("crt", "key", "csr", "ext"))
        openssl(self.folder, "req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                "-keyout", key, "-out", request, "-subj", f"/CN={name}")
        extensions.write_text(f"subjectAltName={names}\n")
        openssl(self.folder, "x509", "-req", "-in", request, "-CA", f"{self.name}.crt", "-CAkey", f"{self.name}.key",
                "-CAcreateserial", "-days", days, "-out", certificate, "-extfile", extensions)
        return certificate, key
