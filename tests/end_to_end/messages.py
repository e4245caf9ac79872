"""The messages of shaped.v1 and google.rpc as Python classes, made by protoc once a test program."""

import atexit
import importlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

PROTO = pathlib.Path(os.environ["SHAPED_SOURCE"]) / "proto"
FOLDER = tempfile.mkdtemp()
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
subprocess.run(["protoc", f"--python_out={FOLDER}", "-I", PROTO, *sorted(PROTO.glob("shaped/v1/*.proto")),
                *sorted(PROTO.glob("google/rpc/*.proto"))], check=True)
sys.path.insert(0, FOLDER)

shapes_pb2 = importlib.import_module("shaped.v1.shapes_pb2")
error_details_pb2 = importlib.import_module("google.rpc.error_details_pb2")
status_pb2 = importlib.import_module("google.rpc.status_pb2")


class Refusal:
    """What a failed call tells programs: status, reason, field and the time to come back [s]."""

    def __init__(self, error):
        self.code, self.text = error.code(), error.details()
        self.reason = self.field = self.retry_after = None
        self.metadata = dict(error.trailing_metadata() or ())
        details = status_pb2.Status.FromString(self.metadata.get("grpc-status-details-bin", b""))
        for detail in details.details:
            for kind in (error_details_pb2.ErrorInfo, error_details_pb2.BadRequest, error_details_pb2.RetryInfo):
                message = kind()
                if not detail.Unpack(message):
                    continue
                if kind is error_details_pb2.ErrorInfo:
                    self.reason = message.reason
                elif kind is error_details_pb2.BadRequest:
                    self.field = message.field_violations[0].field
                else:
                    self.retry_after = message.retry_delay.ToTimedelta().total_seconds()
