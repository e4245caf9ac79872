#include "server/rpc/datasets_service.h"

#include "core/numerics/error.h"
#include "server/convert/dataset.h"
#include "server/convert/mesh.h"
#include "server/convert/scan.h"
#include "server/rpc/incoming_stream_call.h"
#include "server/rpc/unary_call.h"

namespace shaped::server {
namespace {

/// Takes the frames or the scans of one dataset in.
class UploadHandler final : public StreamHandler<v1::UploadDatasetRequest, v1::UploadDatasetResponse> {
 public:
  UploadHandler(DatasetStore& store, const Limits& limits) : store_(store), limits_(limits) {}

  bool message(const v1::UploadDatasetRequest& request, v1::UploadDatasetResponse&, Call&) override {
    if (request.has_header())
      begin(request.header());
    else if (request.has_frame())
      append(request.frame());
    else if (request.has_scan())
      append(request.scan());
    else
      throw InvalidInput("part", "is neither header nor frame nor scan");
    return false;
  }

  bool end(v1::UploadDatasetResponse& response, Call&) override {
    if (!begun()) throw InvalidInput("header", "is missing: the stream was empty");
    toProto(shapes_ ? shapes_->commit() : scans_->commit(), *response.mutable_dataset());
    shapes_.reset();
    scans_.reset();
    return false;
  }

 private:
  bool begun() const { return shapes_ || scans_; }

  void begin(const v1::UploadDatasetRequest::Header& header) {
    if (begun()) throw InvalidInput("header", "came a second time");
    if (kindFromProto(header.kind(), "header.kind") == DatasetKind::kScans)
      beginScans(header);
    else
      beginShapes(header);
  }

  void beginShapes(const v1::UploadDatasetRequest::Header& header) {
    auto faces = facesFromProto(header.faces(), header.vertex_count(), limits_, "header.faces");
    requireAtMost(header.frames(), limits_.frames, "header.frames", "frames");
    shapes_ = store_.begin(header.name(), static_cast<std::int32_t>(header.vertex_count()), std::move(faces),
                           header.frames());
    if (header.template_positions().empty()) return;
    const auto field = "header.template_positions";
    shapes_->setTemplate(pointsFromProto(header.template_positions(), shapes_->topology().vertexCount(), field));
  }

  void beginScans(const v1::UploadDatasetRequest::Header& header) {
    if (header.vertex_count() != 0 || !header.faces().empty() || !header.template_positions().empty())
      throw InvalidInput("header", "has vertices, faces or a template, which go with shapes and not with raw scans");
    requireAtMost(header.frames(), limits_.frames, "header.frames", "scans");
    scans_ = store_.beginScans(header.name(), header.frames());
  }

  void append(const v1::UploadDatasetRequest::Frame& frame) {
    if (!begun()) throw InvalidInput("header", "is missing: the first message must be it");
    if (!shapes_) throw InvalidInput("part", "is a frame, and the header announced raw scans");
    const auto label = frame.label().empty() ? "" : " (" + frame.label() + ")";
    const auto field = "frames[" + std::to_string(frame_count_++) + "]" + label;
    const std::int64_t vertex_count = shapes_->topology().vertexCount();
    if (frame.positions_size() != 3 * vertex_count)
      throw InvalidInput(field, "has " + std::to_string(frame.positions_size()) + " coordinates, want " +
                                    std::to_string(3 * vertex_count) + " for " + std::to_string(vertex_count) +
                                    " vertices");
    shapes_->append(pointsFromProto(frame.positions(), vertex_count, field), frame.label());
  }

  void append(const v1::UploadDatasetRequest::RawScan& scan) {
    if (!begun()) throw InvalidInput("header", "is missing: the first message must be it");
    if (!scans_) throw InvalidInput("part", "is a raw scan, and the header announced shapes");
    scans_->append(scanFromProto(scan.scan(), limits_, scans_->nextField(scan.name())), scan.name());
  }

  DatasetStore& store_;
  const Limits& limits_;
  std::unique_ptr<DatasetUpload> shapes_;
  std::unique_ptr<ScanUpload> scans_;
  std::int64_t frame_count_ = 0;
};

}  // namespace

grpc::ServerReadReactor<v1::UploadDatasetRequest>* DatasetsService::Upload(grpc::CallbackServerContext* context,
                                                                           v1::UploadDatasetResponse* response) {
  return startClientStream<v1::UploadDatasetRequest, v1::UploadDatasetResponse>(
      runtime_, runtime_.light, "Datasets.Upload", context, response, std::make_unique<UploadHandler>(store_, limits_));
}

grpc::ServerUnaryReactor* DatasetsService::List(grpc::CallbackServerContext* context,
                                                const v1::ListDatasetsRequest* request,
                                                v1::ListDatasetsResponse* response) {
  return startUnary<v1::ListDatasetsRequest, v1::ListDatasetsResponse>(
      runtime_, runtime_.light, "Datasets.List", context, request, response, [this](const auto&, auto& answer, Call&) {
        for (const auto& info : store_.list()) toProto(info, *answer.add_datasets());
      });
}

grpc::ServerUnaryReactor* DatasetsService::Delete(grpc::CallbackServerContext* context,
                                                  const v1::DeleteDatasetRequest* request,
                                                  v1::DeleteDatasetResponse* response) {
  return startUnary<v1::DeleteDatasetRequest, v1::DeleteDatasetResponse>(
      runtime_, runtime_.light, "Datasets.Delete", context, request, response,
      [this](const auto& wanted, auto&, Call&) { store_.remove(wanted.name()); });
}

}  // namespace shaped::server
