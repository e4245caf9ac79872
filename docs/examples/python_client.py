"""Lists the models of a daemon, then projects a bent copy of one model's mean and synthesizes the answer again.

    protoc --python_out=OUT -I proto proto/shaped/v1/*.proto proto/google/rpc/*.proto
    PYTHONPATH=OUT python3 docs/examples/python_client.py 127.0.0.1:50051 MODEL [CA.crt TOKEN_FILE]
"""

import pathlib
import sys

import grpc
import numpy

from google.rpc import error_details_pb2, status_pb2
from shaped.v1 import models_pb2, report_pb2, shapes_pb2

# Shapes may be larger than gRPC's default limit of 4 MiB; the daemon tells its own (Server.GetLimits).
UNLIMITED = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]


def connect(address, ca=None, token=None):
    """A channel: in the clear, or over TLS to a daemon of the authorities in the file `ca`, with a token for every call."""
    if ca is None:
        return grpc.insecure_channel(address, UNLIMITED)
    credentials = grpc.ssl_channel_credentials(pathlib.Path(ca).read_bytes())
    if token:
        credentials = grpc.composite_channel_credentials(credentials, grpc.access_token_call_credentials(token))
    return grpc.secure_channel(address, credentials, UNLIMITED)


def unary(channel, service, method, request, answer_type, timeout=60):
    """Calls shaped.v1.<service>/<method> and returns its answer."""
    call = channel.unary_unary(f"/shaped.v1.{service}/{method}", type(request).SerializeToString, answer_type.FromString)
    return call(request, timeout=timeout)


def details(error):
    """The google.rpc details of an error by name: {"ErrorInfo": ..., "BadRequest": ..., "RetryInfo": ...}."""
    found = {}
    for key, value in error.trailing_metadata() or ():
        if key != "grpc-status-details-bin":
            continue
        for detail in status_pb2.Status.FromString(value).details:
            name = detail.TypeName().rsplit(".", 1)[1]
            message = getattr(error_details_pb2, name)()
            detail.Unpack(message)
            found[name] = message
    return found


def bend(positions):
    """Moves every vertex by a shear that the model can only approximate."""
    size = positions.max(0) - positions.min(0)
    return positions + numpy.outer((positions[:, 0] - positions[:, 0].mean()) ** 2, [0, 0.2 / size.max(), 0])


def main(address, name, ca=None, token_file=None):
    channel = connect(address, ca, token_file and pathlib.Path(token_file).read_text().strip())
    for model in unary(channel, "Models", "List", models_pb2.ListModelsRequest(), models_pb2.ListModelsResponse).models:
        modes = getattr(model, model.kind).modes  # "shell_pga" or "body"
        print(f"{model.model.name}@{model.model.version}: {model.vertex_count} vertices, {modes} modes")

    wanted = models_pb2.GetModelRequest(with_mean=True)
    wanted.model.name = name
    got = unary(channel, "Models", "Get", wanted, models_pb2.GetModelResponse)
    request = shapes_pb2.ProjectRequest()
    request.model.CopyFrom(wanted.model)
    request.shape.positions.extend(bend(numpy.array(got.mean.positions).reshape(-1, 3)).ravel())
    request.shape.topology_id = got.description.topology_id
    projected = unary(channel, "Shapes", "Project", request, shapes_pb2.ProjectResponse)
    print(f"projected: {report_pb2.Termination.Name(projected.report.termination)} in {projected.report.seconds:.2f} s, "
          f"{1000 * projected.score.residual_distance:.1f} mm unexplained, smallest area ratio "
          f"{projected.smallest_area_ratio:.2f}")

    again = shapes_pb2.SynthesizeRequest(coefficients=projected.coefficients)
    again.model.CopyFrom(wanted.model)
    shape = unary(channel, "Shapes", "Synthesize", again, shapes_pb2.SynthesizeResponse).shape
    print(f"synthesized {len(shape.positions) // 3} vertices")

    request.shape.positions.pop()  # what an error looks like
    try:
        unary(channel, "Shapes", "Project", request, shapes_pb2.ProjectResponse)
    except grpc.RpcError as error:
        print(f"refused: {error.code().name}: {error.details()} ({details(error)['ErrorInfo'].reason})")


if __name__ == "__main__":
    main(*sys.argv[1:])
