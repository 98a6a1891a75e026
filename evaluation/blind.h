// A check that cannot leak: campaigns whose keys are sealed before they are answered, and scored only after.
//
// A folder holds record.json, campaigns/ID/, keys.json and answers/ID/diagnosis.json. Each key is sealed as
// SHA-256 of its text and a 256-bit salt when the campaign is made; the record also holds
// the seal of the protocol, the effects and the code that are to answer. Once all answers are there their hash is
// stored; only then are keys opened, and both hashes are checked. Keys may come from someone else.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "diagnose/diagnosis.h"

namespace selvedge::evaluation {

// What a blind check is sealed with: the usual protocol, all effects, and the code (diagnose/protocol.h).
std::string usual_seal();

struct SealedKey {
  std::string id, salt;
  nlohmann::json key;  // at least "cause"
};

// Writes record.json and keys.json of a new blind check. Throws BadInput where the folder has one already.
void seal_keys(const std::filesystem::path& folder, const std::vector<SealedKey>& keys, const std::string& seal);

struct BlindRecord {
  std::vector<std::string> ids, seals;
  std::string library, answers;  // answers: empty until all are there
};
BlindRecord read_record(const std::filesystem::path& folder);
// The same, to be answered. Throws BadInput where the answers are final already, or where it was sealed with another
// `seal` than what would answer.
BlindRecord open_record(const std::filesystem::path& folder, const std::string& seal);

// Diagnoses every campaign that has no answer yet, in the record's order, until `enough` says stop; stores the hash
// of all answers once the last is there. Several processes share the work: each campaign is answered by whoever locks
// it first (answers/ID.lock). Returns how many are answered.
size_t answer_all(const std::filesystem::path& folder, const std::string& seal,
                  const std::function<diagnose::Diagnosis(const std::filesystem::path&)>& diagnose,
                  const std::function<bool()>& enough);

// One campaign alone; while another process has it, this one waits. Does nothing where the answer is there.
// task: name of this process as a task of a batch system, which never runs twice at a time: what a former run of it has
// locked, and died with, is free. Empty where it is none.
void answer_one(const std::filesystem::path& folder, const std::string& seal, const std::string& id,
                const std::string& task,
                const std::function<diagnose::Diagnosis(const std::filesystem::path&)>& diagnose);

struct ScoreRow {
  std::string what, wanted;
  int hits = 0, of = 0;
  double low = 0, high = 1;  // Clopper–Pearson, 95 %
};

struct BlindScore {
  std::vector<ScoreRow> rows, baselines;
  double brier = 0, brier_base_rates = 0, calibration_error = 0;
  double inclusion_error = 0;          // calibration error of inclusion, of those of 0.05 or more
  int inclusions = 0;                  // so many
  double share_error = 0;              // median of |told − true| of the shares of effects that are there and included
  size_t shares = 0;                   // so many
  double reduction_error = 0;          // median of |told − found| of the gap reduction of causes named right
  size_t reductions = 0;               // so many
  std::vector<std::string> sizes;      // of causes named right: what was told, with its interval, and what it truly is
  std::vector<std::string> confusion;  // "true → named: count"
  size_t answered = 0;
};

// A parameter of diagnosis.json's effect_size, and what it truly is; nothing where a key's effect has none of the same
// kind.
struct TrueParameter {
  std::string name;
  double value = 0;
};

// A campaign's answer beside its key.
struct Opened {
  std::string id, truth, named;
  double probability = 0;  // of what was named
  double ratio = 0;        // of the gap, above what a right model leaves, to that
  bool right = false;
};

// What is known of a key's campaign beside its cause; what is empty is not scored.
struct Truth {
  // Told all answers beside their keys, before any of what follows is asked for.
  std::function<void(const std::vector<Opened>& answers)> begins;
  // Told the share of all that follows that is done, and of which campaign it is asked next.
  std::function<void(double done, const std::string& id)> on_progress;
  // The share of the gap that an effect closes in fresh trials; nothing where none can be made.
  std::function<std::optional<double>(const SealedKey& key, const nlohmann::json& diagnosis, const std::string& effect)>
      reduction;
  std::function<std::optional<TrueParameter>(const SealedKey& key)> size;
  // What each of the key's effects truly takes of the gap (true_shares.h); empty where that cannot be found.
  std::function<std::map<std::string, double>(const SealedKey& key, const nlohmann::json& diagnosis)> shares;
};

// Checks the seals and the answers' hash, then scores. partial: score what is answered, without the hash of all.
BlindScore open_keys(const std::filesystem::path& folder, const std::string& seal, bool partial,
                     const Truth& truth = {});

struct NamedRight {
  std::string id, cause;
};
// Campaigns with effects of the library whose first name was right, and that name. Keys are opened as in open_keys.
std::vector<NamedRight> named_right(const std::filesystem::path& folder, const std::string& seal, bool partial);

// Of answers without/ID/diagnosis.json, given with the true cause's effect deleted: unknown, none, another name.
std::vector<ScoreRow> score_without(const std::filesystem::path& folder, const std::vector<NamedRight>& campaigns);

// Exact binomial interval.
std::pair<double, double> clopper_pearson(int hits, int of, double level = 0.95);

}  // namespace selvedge::evaluation
