"""Lists the models of a daemon, then projects a bent copy of one model's mean and synthesizes the answer again.

    protoc --python_out=OUT -I proto proto/shaped/v1/*.proto
    PYTHONPATH=OUT python3 docs/examples/python_client.py 127.0.0.1:50051 MODEL
"""

import sys

import grpc
import numpy

from shaped.v1 import models_pb2, report_pb2, shapes_pb2


def unary(channel, service, method, request, answer_type, timeout=60):
    """Calls shaped.v1.<service>/<method> and returns its answer."""
    call = channel.unary_unary(f"/shaped.v1.{service}/{method}", type(request).SerializeToString, answer_type.FromString)
    return call(request, timeout=timeout)


def main(address, name):
    # Shapes are larger than gRPC's default limit of 4 MiB may allow.
    channel = grpc.insecure_channel(address, [("grpc.max_receive_message_length", 64 << 20)])
    for model in unary(channel, "Models", "List", models_pb2.ListModelsRequest(), models_pb2.ListModelsResponse).models:
        print(f"{model.model.name}@{model.model.version}: {model.vertex_count} vertices, {model.shell_pga.modes} modes")

    wanted = models_pb2.GetModelRequest(with_mean=True)
    wanted.model.name = name
    got = unary(channel, "Models", "Get", wanted, models_pb2.GetModelResponse)
    mean = numpy.array(got.mean.positions).reshape(-1, 3)

    # A shear that the model can only approximate.
    size = mean.max(0) - mean.min(0)
    sheared = mean + numpy.outer((mean[:, 0] - mean[:, 0].mean()) ** 2, [0, 0.2 / size.max(), 0])
    request = shapes_pb2.ProjectRequest()
    request.model.CopyFrom(wanted.model)
    request.shape.positions.extend(sheared.ravel())
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
        print(f"refused: {error.code().name}: {error.details()}")


if __name__ == "__main__":
    main(*sys.argv[1:])
