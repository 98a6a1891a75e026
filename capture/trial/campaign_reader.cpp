#include <algorithm>

#include "capture/trial/trial.h"
#include "files/bad_input.h"
#include "files/json_reader.h"

namespace selvedge::trial {

namespace fs = std::filesystem;
using files::JsonReader;

namespace {

std::vector<std::string> read_names(const JsonReader& json) {
  const std::vector<std::string> names = json.texts("trials");
  if (names.empty()) refuse(json.where("trials"), "found an empty list, expected at least one trial");
  for (const std::string& name : names) {
    if (name.empty() || name == "." || name == ".." || name.find('/') != std::string::npos)
      refuse(json.where("trials"), "found {}, expected the name of a folder beside campaign.json", in_quotes(name));
    if (std::count(names.begin(), names.end(), name) != 1)
      refuse(json.where("trials"), "found {} more than once, expected each trial once", in_quotes(name));
  }
  return names;
}

std::vector<std::vector<std::string>> read_replicates(const JsonReader& json, const std::vector<std::string>& names) {
  const nlohmann::json& groups = json.value("replicates");
  const std::string where = json.where("replicates");
  if (!groups.is_array()) refuse(where, "found {}, expected a list of lists", files::shown(groups));
  std::vector<std::vector<std::string>> replicates;
  for (const nlohmann::json& group : groups) {
    if (!group.is_array()) refuse(where, "found {}, expected a list of names", files::shown(group));
    replicates.emplace_back();
    for (const nlohmann::json& name : group) {
      if (!name.is_string() || std::count(names.begin(), names.end(), name.get<std::string>()) == 0)
        refuse(where, "found {}, expected a name out of \"trials\"", files::shown(name));
      replicates.back().push_back(name);
    }
  }
  return replicates;
}

}  // namespace

Campaign read_campaign(const fs::path& folder) {
  Campaign campaign;
  campaign.folder = folder;
  std::error_code error;
  if (!fs::exists(folder / "campaign.json", error)) {
    if (fs::is_directory(folder, error) && !fs::exists(folder / "trial.json", error))
      refuse(folder.string(),
             "found neither campaign.json nor trial.json, expected one of them (./selvedge import makes a trial of "
             "others' files)");
    campaign.trials.push_back(read_trial(folder));
    campaign.fabric = campaign.trials.front().fabric.name;
    return campaign;
  }
  const JsonReader json(folder / "campaign.json");
  json.choice("format", {"campaign/1"});
  campaign.fabric = json.text("fabric");
  const std::vector<std::string> names = read_names(json);
  if (json.has("replicates")) campaign.replicates = read_replicates(json, names);
  for (const std::string& name : names) campaign.trials.push_back(read_trial(folder / name));
  return campaign;
}

Campaign joined(const std::vector<Campaign>& campaigns) {
  Campaign all = campaigns.front();
  for (size_t i = 1; i < campaigns.size(); ++i) {
    const Campaign& more = campaigns[i];
    for (size_t earlier = 0; earlier < i; ++earlier)
      if (fs::weakly_canonical(fs::absolute(more.folder)) ==
          fs::weakly_canonical(fs::absolute(campaigns[earlier].folder)))
        refuse(more.folder.string(), "found the same campaign twice, expected each once");
    if (more.fabric != all.fabric)
      refuse(more.folder.string(), "found the fabric {}, expected {} as in {}", in_quotes(more.fabric),
             in_quotes(all.fabric), all.folder.string());
    const size_t before = all.trials.size();
    const auto taken = [&](const std::string& name) {
      return std::any_of(all.trials.begin(), all.trials.begin() + static_cast<std::ptrdiff_t>(before),
                         [&](const Trial& t) { return t.name == name; });
    };
    const auto unused = [&](std::string name) {
      while (taken(name)) name += " of " + more.folder.filename().string();
      return name;
    };
    for (Trial trial : more.trials) {
      trial.name = unused(trial.name);
      all.trials.push_back(std::move(trial));
    }
    for (std::vector<std::string> group : more.replicates) {
      for (std::string& name : group) name = unused(name);
      all.replicates.push_back(std::move(group));
    }
  }
  return all;
}

}  // namespace selvedge::trial
