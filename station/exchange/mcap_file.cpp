#include "station/exchange/mcap_file.h"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <zlib.h>

namespace selvedge::station {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers of an MCAP file are little-endian");

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr size_t kChunk = size_t{1} << 22;
constexpr uint16_t kNoSchemaYet = 0;  // the first schema is 1: 0 means none

enum class Opcode : uint8_t {
  header = 1,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  statistics = 0x0b,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
};

template <class Number>
void put_number(std::string& into, Number value) {
  into.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// Bytes behind their count.
template <class Count = uint32_t>
void put_counted(std::string& into, std::string_view bytes) {
  put_number(into, static_cast<Count>(bytes.size()));
  into.append(bytes);
}

std::string record(Opcode opcode, const std::string& content) {
  std::string out;
  put_number(out, static_cast<uint8_t>(opcode));
  put_counted<uint64_t>(out, content);
  return out;
}

template <class Pairs>
std::string numbers_of(const Pairs& pairs) {
  std::string out;
  for (const auto& [key, value] : pairs) {
    put_number(out, key);
    put_number(out, value);
  }
  return out;
}

uint32_t crc_of(uint32_t before, std::string_view bytes) {
  return static_cast<uint32_t>(::crc32(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

McapFile::McapFile(const std::filesystem::path& path, const std::string& library)
    : out_(path, std::ios::binary | std::ios::trunc), path_(path) {
  std::string header;
  put_counted(header, "");
  put_counted(header, library);
  put(std::string(kMagic));
  put(record(Opcode::header, header));
}

void McapFile::put(const std::string& bytes) {
  if (!out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw std::runtime_error(fmt::format("{}: cannot write", path_.string()));
  at_ += bytes.size();
  crc_ = crc_of(crc_, bytes);
}

uint16_t McapFile::channel(const std::string& topic, const std::string& type, const std::string& json_schema) {
  uint16_t& schema = types_.try_emplace(type, kNoSchemaYet).first->second;
  if (schema == kNoSchemaYet) {
    schema = static_cast<uint16_t>(types_.size());
    std::string content;
    put_number(content, schema);
    put_counted(content, type);
    put_counted(content, "jsonschema");
    put_counted(content, json_schema);
    told_.push_back(record(Opcode::schema, content));
    chunk_ += told_.back();
  }
  const auto number = static_cast<uint16_t>(count_.size());
  std::string content;
  put_number(content, number);
  put_number(content, schema);
  put_counted(content, topic);
  put_counted(content, "json");
  put_counted(content, "");
  told_.push_back(record(Opcode::channel, content));
  chunk_ += told_.back();
  count_[number] = 0;
  return number;
}

void McapFile::metadata(const std::string& name, const std::map<std::string, std::string>& values) {
  std::string content, pairs;
  for (const auto& [key, value] : values) {
    put_counted(pairs, key);
    put_counted(pairs, value);
  }
  put_counted(content, name);
  put_counted(content, pairs);
  const std::string written = record(Opcode::metadata, content);
  std::string index;
  put_number(index, at_);
  put_number(index, static_cast<uint64_t>(written.size()));
  put_counted(index, name);
  metadata_index_.push_back(record(Opcode::metadata_index, index));
  put(written);
}

void McapFile::message(uint16_t channel, uint64_t time_ns, const std::string& json) {
  const bool is_first = chunk_index_.empty();
  chunk_first_ns_ = is_first ? time_ns : std::min(chunk_first_ns_, time_ns);
  chunk_last_ns_ = is_first ? time_ns : std::max(chunk_last_ns_, time_ns);
  chunk_index_[channel].emplace_back(time_ns, chunk_.size());
  std::string content;
  put_number(content, channel);
  put_number(content, static_cast<uint32_t>(count_[channel]++));
  put_number(content, time_ns);  // when it was logged, and when published
  put_number(content, time_ns);
  chunk_ += record(Opcode::message, content + json);
  if (chunk_.size() >= kChunk) end_chunk();
}

void McapFile::end_chunk() {
  if (chunk_.empty()) return;
  ChunkIndex about;
  about.first_ns = chunk_first_ns_;
  about.last_ns = chunk_last_ns_;
  about.at = at_;
  about.size = chunk_.size();
  std::string content;
  put_number(content, about.first_ns);
  put_number(content, about.last_ns);
  put_number(content, about.size);
  put_number(content, crc_of(0, chunk_));
  put_counted(content, "");  // not compressed
  put_counted<uint64_t>(content, chunk_);
  put(record(Opcode::chunk, content));
  about.length = at_ - about.at;
  for (const auto& [channel, places] : chunk_index_) {
    about.index_at[channel] = at_;
    std::string index;
    put_number(index, channel);
    put_counted(index, numbers_of(places));
    put(record(Opcode::message_index, index));
  }
  about.index_length = at_ - about.at - about.length;
  chunks_.push_back(about);
  chunk_.clear();
  chunk_index_.clear();
  chunk_first_ns_ = chunk_last_ns_ = 0;
}

// Each kind of record in a group, then where the groups are; returns where that begins.
uint64_t McapFile::put_summary() {
  std::map<Opcode, std::string> groups;
  for (const std::string& schema_or_channel : told_)
    groups[static_cast<Opcode>(schema_or_channel.front())] += schema_or_channel;
  for (const std::string& index : metadata_index_) groups[Opcode::metadata_index] += index;
  for (const ChunkIndex& c : chunks_) {
    std::string content;
    for (const uint64_t number : {c.first_ns, c.last_ns, c.at, c.length}) put_number(content, number);
    put_counted(content, numbers_of(c.index_at));
    put_number(content, c.index_length);
    put_counted(content, "");
    put_number(content, c.size);
    put_number(content, c.size);
    groups[Opcode::chunk_index] += record(Opcode::chunk_index, content);
  }
  groups[Opcode::statistics] = record(Opcode::statistics, statistics());
  std::string offsets;
  for (const auto& [opcode, group] : groups) {
    std::string content;
    put_number(content, static_cast<uint8_t>(opcode));
    put_number(content, at_);
    put_number(content, static_cast<uint64_t>(group.size()));
    offsets += record(Opcode::summary_offset, content);
    put(group);
  }
  const uint64_t begin = at_;
  put(offsets);
  return begin;
}

std::string McapFile::statistics() const {
  uint64_t first_ns = chunks_.empty() ? 0 : chunks_.front().first_ns, last_ns = 0;
  for (const ChunkIndex& c : chunks_) {
    first_ns = std::min(first_ns, c.first_ns);
    last_ns = std::max(last_ns, c.last_ns);
  }
  std::string out;
  put_number(out, messages());
  put_number(out, static_cast<uint16_t>(types_.size()));
  put_number(out, static_cast<uint32_t>(count_.size()));
  put_number(out, uint32_t{0});  // attachments
  put_number(out, static_cast<uint32_t>(metadata_index_.size()));
  put_number(out, static_cast<uint32_t>(chunks_.size()));
  put_number(out, first_ns);
  put_number(out, last_ns);
  put_counted(out, numbers_of(count_));
  return out;
}

uint64_t McapFile::messages() const {
  uint64_t out = 0;
  for (const auto& [channel, count] : count_) out += count;
  return out;
}

uint64_t McapFile::finish() {
  end_chunk();
  std::string end, footer;
  put_number(end, crc_);
  put(record(Opcode::data_end, end));
  crc_ = 0;
  const uint64_t summary = at_;
  put_number(footer, summary);
  put_number(footer, put_summary());
  const std::string whole = record(Opcode::footer, footer + std::string(sizeof(uint32_t), 0));  // its CRC comes last
  put(whole.substr(0, whole.size() - sizeof(uint32_t)));
  std::string crc;
  put_number(crc, crc_);
  put(crc);
  put(std::string(kMagic));
  if (!out_.flush()) throw std::runtime_error(fmt::format("{}: cannot write", path_.string()));
  return messages();
}

}  // namespace selvedge::station
