// Numbers as bytes between ranks: of one machine type, so in its own order.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include <Eigen/Core>

namespace selvedge::model {

inline void put(std::string& bytes, std::uint64_t value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void put(std::string& bytes, const double* values, Eigen::Index count) {
  put(bytes, static_cast<std::uint64_t>(count));
  bytes.append(reinterpret_cast<const char*>(values), sizeof(double) * static_cast<size_t>(count));
}

// Throws std::runtime_error where less is left than asked for.
class TakenBytes {
 public:
  explicit TakenBytes(const std::string& bytes) : bytes_(bytes) {}
  std::uint64_t number() {
    std::uint64_t value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  Eigen::VectorXd numbers() {
    const std::uint64_t count = number();
    if (count > bytes_.size() / sizeof(double)) throw std::runtime_error("ranks: a message is cut");
    Eigen::VectorXd values(static_cast<Eigen::Index>(count));
    if (count > 0) std::memcpy(values.data(), take(sizeof(double) * count), sizeof(double) * count);
    return values;
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const char* take(size_t count) {
    if (count > bytes_.size() - at_) throw std::runtime_error("ranks: a message is cut");
    at_ += count;
    return bytes_.data() + at_ - count;
  }
  const std::string& bytes_;
  size_t at_ = 0;
};

// First in every share: what kind of batch it belongs to. A rank that has come to another one must not answer.
enum class Batch : std::uint64_t { costs = 0x636f737473, residuals = 0x726573 };

inline void require(TakenBytes& in, Batch kind) {
  if (in.number() != static_cast<std::uint64_t>(kind))
    throw std::runtime_error("ranks: this rank has come to another batch than the first");
}

}  // namespace selvedge::model
