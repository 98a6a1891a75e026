// `./selvedge bench bus`: what the signature of the bus's messages costs, beside LCM alone in the same run.
//
// Processor time of publishing a message and receiving it once, of all threads: LCM's reader is one of them. A small
// message is a tracker's sample of four markers; a large one fills 300 KB, more than anything that the rig sends.
#include <sys/resource.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <lcm/lcm.h>
#include <selvedge_rig/corner_sample_t.hpp>

#include "cli/verify/figures.h"
#include "rig/bus.h"
#include "rig/clock.h"
#include "rig/network.h"

namespace selvedge::cli {

namespace {

using selvedge_rig::corner_sample_t;

constexpr int kSignaturePort = 17292;
constexpr const char* kSamples = "TRACKER_CORNERS";
constexpr double kPatience_s = 60;
// Counted by lcm-logger beside a demo, between its trials and in them; each message heard by session, console and arm.
constexpr double kDemoMessages_hz = 315, kDemoBytes_hz = 280e3, kDemoReceivers = 3;

corner_sample_t sample_of(int markers) {
  corner_sample_t sample{};
  const auto count = static_cast<size_t>(markers);
  sample.count = markers;
  sample.name.assign(count, "marker");
  sample.x_m = sample.y_m = sample.z_m = std::vector<double>(count, 0.25);
  sample.occluded.assign(count, 0);
  return sample;
}

double own_cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Both ways send one message at a time and wait for it: nothing queues, nothing is lost.
class Way {
 public:
  virtual ~Way() = default;
  virtual void send(corner_sample_t& sample) = 0;
  virtual void handle() = 0;
  int64_t heard = 0;
};

class SignedBus : public Way {
 public:
  explicit SignedBus(const rig::BusConfiguration& configuration) : sender_(configuration), receiver_(configuration) {
    receiver_.subscribe<corner_sample_t>(kSamples, [this](const corner_sample_t&) { ++heard; });
  }
  void send(corner_sample_t& sample) override { sender_.publish(kSamples, sample); }
  void handle() override { receiver_.handle(0.1); }

 private:
  rig::Bus sender_, receiver_;
};

class LcmAlone : public Way {
 public:
  explicit LcmAlone(const rig::BusConfiguration& configuration) {
    const std::string url = fmt::format("udpm://239.255.76.67:{}?ttl=0&recv_buf_size={}", configuration.port,
                                        configuration.receive_buffer_bytes);
    sender_ = lcm_create(url.c_str());
    receiver_ = lcm_create(url.c_str());
    if (sender_ == nullptr || receiver_ == nullptr) throw std::runtime_error("bench: LCM cannot open " + url);
    const auto decode = [](const lcm_recv_buf_t* buffer, const char*, void* self) {
      corner_sample_t sample;
      if (sample.decode(buffer->data, 0, static_cast<int>(buffer->data_size)) > 0)
        ++static_cast<LcmAlone*>(self)->heard;
    };
    lcm_subscribe(receiver_, kSamples, decode, this);
  }
  ~LcmAlone() override {
    lcm_destroy(sender_);
    lcm_destroy(receiver_);
  }
  void send(corner_sample_t& sample) override {
    std::vector<uint8_t> bytes(static_cast<size_t>(sample.getEncodedSize()));
    sample.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    lcm_publish(sender_, kSamples, bytes.data(), static_cast<unsigned>(bytes.size()));
  }
  void handle() override { lcm_handle_timeout(receiver_, 100); }

 private:
  lcm_t *sender_ = nullptr, *receiver_ = nullptr;
};

double cpu_us_per_message(Way& way, corner_sample_t& sample, int messages) {
  const double start_s = own_cpu_s();
  for (int i = 0; i < messages; ++i) {
    const int64_t before = way.heard;
    way.send(sample);
    const double end_s = rig::host_now_s() + kPatience_s;
    while (way.heard == before) {
      way.handle();
      if (rig::host_now_s() > end_s) throw std::runtime_error("bench: a message did not arrive");
    }
  }
  return 1e6 * (own_cpu_s() - start_s) / messages;
}

}  // namespace

std::vector<Figure> bench_bus(const FigureOptions& options) {
  rig::BusConfiguration configuration;
  configuration.port = kSignaturePort;
  rig::ensure_local_multicast(static_cast<uint16_t>(configuration.port));
  const int blocks = options.quick ? 3 : 15;
  struct Size {
    const char* name;
    int markers, messages;
    double demo_hz;
  };
  std::vector<Figure> figures;
  double added_us = 0;  // in a second of the demo's rig
  for (const Size& size : {Size{"a sample of four markers", 4, 2000, kDemoMessages_hz},
                           Size{"a message of 300 KB", 8334, 100, kDemoBytes_hz / 3e5}}) {
    corner_sample_t sample = sample_of(size.markers);
    // One after the other on the port, block by block: what else the machine does meets both.
    std::vector<double> signed_us, alone_us;
    for (int block = 0; block < blocks; ++block) {
      signed_us.push_back(cpu_us_per_message(*std::make_unique<SignedBus>(configuration), sample, size.messages));
      alone_us.push_back(cpu_us_per_message(*std::make_unique<LcmAlone>(configuration), sample, size.messages));
      options.progress((block + 1.0) / blocks, size.name);
    }
    const double with_us = median(signed_us), without_us = median(alone_us);
    const std::string what =
        fmt::format("{} ({} bytes), published and received, processor time", size.name, sample.getEncodedSize());
    figures.push_back({what, with_us, without_us, "us", Relation::shown, "LCM alone, unsigned, same run"});
    added_us += size.demo_hz * (1 + kDemoReceivers) / 2 * (with_us - without_us);
  }
  figures.push_back({"what signing and checking add to the demo's rig", 1e-4 * added_us, 2, "% of a core",
                     Relation::at_most, "the bound set for it"});
  return figures;
}

}  // namespace selvedge::cli
