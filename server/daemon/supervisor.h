#pragma once

#include <string>

namespace shaped::server {

/// Tells the supervisor that started the process (systemd, Type=notify) how it stands: "READY=1", "STOPPING=1". Nobody
/// listens where NOTIFY_SOCKET names no socket: nothing happens then, and neither does when the message cannot be sent.
void notifySupervisor(const std::string& state);

}  // namespace shaped::server
