// Fabrics that were measured: a lab's own, out of its fits, and tables of others. Files *.json in one folder:
//   {"format": "fabrics/1", "source": …, "fabrics": [{"name", "areal_mass", "bend_warp", "bend_weft",
//    "second_order_warp", "second_order_weft"}]}, kg/m², N·m, N·m² (the last two where they are known).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace selvedge::material_tests {

struct LibraryFabric {
  std::string name, source;
  double areal_mass = 0;  // kg/m²
  double bend_warp = 0, bend_weft = 0;
  std::optional<double> second_order_warp, second_order_weft;
};

double mean_bend(const LibraryFabric& fabric);       // geometric mean of both ways
double bending_length(const LibraryFabric& fabric);  // of that, m

// given; where it is empty, selvedge/fabrics below $XDG_DATA_HOME or ~/.local/share.
std::filesystem::path library_folder(const std::filesystem::path& given);

// By source and name; none where there is no such folder. Throws BadInput naming file and key.
std::vector<LibraryFabric> read_library(const std::filesystem::path& folder);

// By name. Throws BadInput where there is none, or several of different sources.
LibraryFabric fabric_named(const std::vector<LibraryFabric>& library, const std::string& name,
                           const std::filesystem::path& folder);

// What a fit.json says of its fabric, under the fit's fabric name or its campaign's. Throws BadInput where bend or mass
// are not in it.
LibraryFabric fabric_of_fit(const std::filesystem::path& fit_json);

// Rows of a CSV: areal_mass (or density), bend_warp and bend_weft (or linear warp, linear weft), second_order_warp and
// second_order_weft (or nonlinear warp, nonlinear weft) where they are there, name where it is there (else the row's
// number); SI, or as a header says by its scale: "linear warp[SI*1e9]". Throws BadInput naming line and column.
std::vector<LibraryFabric> fabrics_of_table(const std::filesystem::path& table);

// FOLDER/FILE.json. Throws BadInput where it is there already.
void add_to_library(const std::filesystem::path& folder, const std::string& file,
                    const std::vector<LibraryFabric>& fabrics);

// Where a fabric lies among those of the library, or, where that holds fewer than 20, among 618 whose percentiles are
// published (Feng et al. 2022): a sentence, and one more where none lies near.
std::vector<std::string> place_among(const std::vector<LibraryFabric>& library, double bending_length_m,
                                     double areal_mass);

}  // namespace selvedge::material_tests
