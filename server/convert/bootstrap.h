#pragma once

#include "core/bootstrap/bootstrap_report.h"
#include "shaped/v1/jobs.pb.h"

namespace shaped::server {

void toProto(const BootstrapScan& scan, v1::BootstrapScan& message);
void toProto(const BootstrapRound& round, v1::BootstrapRound& message);
v1::BootstrapEnd toProto(BootstrapEnd end);

}  // namespace shaped::server
