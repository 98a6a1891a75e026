#include "station/diagnosis_folder.h"

#include <fmt/format.h>

namespace selvedge::station {

std::string diagnosis_folder_name(int round) {
  return round == 0 ? "diagnosis" : fmt::format("diagnosis-{}", round + 1);
}

std::filesystem::path newest_diagnosis_folder(const std::filesystem::path& fabric) {
  int newest = 0;
  while (std::filesystem::exists(fabric / diagnosis_folder_name(newest + 1) / "diagnosis.json")) ++newest;
  return fabric / diagnosis_folder_name(newest);
}

}  // namespace selvedge::station
