#include "rig/tracker/backends/natnet_packets.h"

using namespace selvedge;
using namespace selvedge::tracker;

// The first byte chooses the bitstream; the rest is one datagram of whatever kind its header says.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  natnet::ServerInfo server;
  server.version = {data[0] % 2 == 0 ? 3 : 4, data[0] / 2 % 4, 0, 0};
  server.ticks_per_s = 1e7;
  const natnet::Model model = {{{"fabric", {"left", "right"}}}, {{1, "fabric"}}};
  try {
    const auto message = natnet::take_message({data + 1, size - 1});
    if (message.id == natnet::server_info) natnet::decode_server_info(message.payload);
    if (message.id == natnet::model_definition) natnet::decode_model(message.payload, server);
    if (message.id == natnet::frame_of_data) natnet::decode_frame(message.payload, server, model);
  } catch (const wire::WireError&) {}
  return 0;
}
