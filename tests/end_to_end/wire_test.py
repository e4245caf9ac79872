"""What any gRPC client finds: health, reflection, all services."""

import unittest

import grpc

from support import NOT_FOUND, DaemonCase


def call(channel, method, message):
    """A unary call with messages as bytes."""
    return channel.unary_unary(method, lambda data: data, lambda data: data)(message, timeout=10)


class Wire(DaemonCase):
    def setUp(self):
        self.channel = grpc.insecure_channel(self.daemon.address)
        self.addCleanup(self.channel.close)

    def test_health(self):
        # HealthCheckResponse{status: SERVING}, for the daemon and for each of its services.
        self.assertEqual(call(self.channel, "/grpc.health.v1.Health/Check", b""), b"\x08\x01")

    def test_reflection_lists_the_services(self):
        list_services = b"\x3a\x00"
        method = self.channel.stream_stream("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                            lambda data: data, lambda data: data)
        answer = next(method(iter([list_services]), timeout=10))
        for service in ("Models", "Datasets", "Jobs", "Shapes", "Curves", "Registration", "Server", "Admin"):
            self.assertIn(b"shaped.v1." + service.encode(), answer)

    def test_limits_are_told(self):
        answer = call(self.channel, "/shaped.v1.Server/GetLimits", b"")
        self.assertIn(b"shaped 0.", answer)
        self.assertIn(b"\x08\x80\x89\x7a", answer)  # Limits {vertices: 2,000,000}

    def test_errors_carry_details(self):
        with self.assertRaises(grpc.RpcError) as raised:
            call(self.channel, "/shaped.v1.Models/Get", b"\x0a\x05\x0a\x03cat")
        self.assertEqual(raised.exception.code(), grpc.StatusCode.NOT_FOUND)
        details = dict(raised.exception.trailing_metadata())["grpc-status-details-bin"]
        self.assertIn(b"type.googleapis.com/google.rpc.ErrorInfo", details)
        self.assertIn(b"MODEL_NOT_FOUND", details)
        error = self.expect(NOT_FOUND, "describe", "cat").json["error"]
        self.assertEqual((error["kind"], error["reason"]), ("not_found", "MODEL_NOT_FOUND"))

    def test_garbage_is_refused(self):
        one, many = (lambda data: data), (lambda data: iter([data]))
        for kind, method, wrap in (("unary_unary", "Models/Get", one), ("unary_unary", "Jobs/Wait", one), ("unary_stream", "Jobs/Watch", one),
                                   ("unary_stream", "Shapes/Interpolate", one), ("stream_unary", "Datasets/Upload", many),
                                   ("stream_stream", "Shapes/FitMarkers", many), ("unary_unary", "Registration/Register", one),
                                   ("stream_stream", "Registration/RegisterSequence", many),
                                   ("stream_stream", "Registration/EstimateUnderClothing", many)):
            with self.subTest(method), self.assertRaises(grpc.RpcError) as raised:
                answer = getattr(self.channel, kind)("/shaped.v1." + method)(wrap(b"\xff\xff\xff"), timeout=10)
                list(answer)  # of a stream
            error = raised.exception
            self.assertEqual(error.code(), grpc.StatusCode.INVALID_ARGUMENT)
            self.assertIn("message: is no shaped.v1.", error.details())
            self.assertIn(b"INVALID_FIELD", dict(error.trailing_metadata())["grpc-status-details-bin"])


if __name__ == "__main__":
    unittest.main()
