// Where the diagnoses of a fabric lie, one folder a round.
#pragma once

#include <filesystem>
#include <string>

namespace selvedge::station {

// "diagnosis", "diagnosis-2" after the first follow-up …: folder of a round's diagnosis.
std::string diagnosis_folder_name(int round);
// The newest diagnosis of a fabric's folder: that of the last follow-up. The first one's name where there is none.
std::filesystem::path newest_diagnosis_folder(const std::filesystem::path& fabric);

}  // namespace selvedge::station
