// Files of instruments and of other labs as material tests.
#include <fstream>

#include <gtest/gtest.h>

#include "files/whole_file.h"
#include "station/exchange/hdf5_handle.h"
#include "station/exchange/material_import.h"
#include "tests/refusal.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

class MaterialImports : public testing::Test {
 protected:
  MaterialImport from(const std::string& name, const std::string& text) const {
    files::write_whole(folder_ / name, text);
    MaterialImport out;
    out.file = folder_ / name;
    out.fabric = "denim";
    out.areal_mass = 0.4;
    out.angle_deg = 90;
    return out;
  }

  // Two pulls of four frames; the strip doubles its length and narrows to 0.8.
  MaterialImport hdf5(const std::vector<double>& forces = {0, 1, 2, 3}) const {
    const fs::path path = folder_ / "pulls.h5";
    {
      const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose, "file");
      const auto put = [](hid_t at, const char* name, std::vector<hsize_t> size, const std::vector<double>& values) {
        const Handle space(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose, name);
        const Handle set(H5Dcreate2(at, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Dclose, name);
        require(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), name);
      };
      put(file, "clampSize", {1}, {100});
      put(file, "fabricSize", {1}, {250});
      for (const char* name : {"video10", "video2"}) {
        const Handle group(H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name);
        std::vector<double> traj;
        const double at[4][2] = {{0, 100}, {200, 100}, {100, 200}, {100, 0}};
        for (int point = 0; point < 4; ++point)
          for (int axis = 0; axis < 2; ++axis)
            for (int frame = 0; frame < 4; ++frame) {
              const double grows = axis == 0 ? 1 - 0.2 * frame / 3 : 1 + frame / 3.0;
              traj.push_back(at[point][axis] * grows);
            }
        put(group, "traj", {4, 2, 4}, traj);
        put(group, "forces", {forces.size()}, forces);
        put(group, "frames", {4}, {5, 6, 7, 9});
      }
    }
    MaterialImport out;
    out.file = path;
    out.fabric = "knit";
    out.angle_deg = 0;
    out.hdf5.clamp_m = 0.05;
    return out;
  }

  const rig::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(MaterialImports, OfSeveralTrialsAllAreWrittenOrNone) {
  const auto strips = import_cantilever(from("lengths.csv", "bending_length_mm,overhang_mm\n20,40\n20,20000\n"));
  ASSERT_EQ(strips.trials.size(), 2u);
  const fs::path out = folder_ / "campaign";
  EXPECT_NE(refusal_of([&] { add_to_campaign(strips.trials, out); }).find("overhang_m"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(out));
}

TEST_F(MaterialImports, APullsNumberIsAWholeOne) {
  MaterialImport pulls = from("pulls.csv", "pull,force,stretch_along\n1.5,0,1\n1.5,1,1.1\n");
  pulls.width_m = 0.05;
  pulls.height_m = 0.2;
  const std::string said = refusal_of([&] { import_tensile(pulls); });
  EXPECT_NE(said.find("pulls.csv:2"), std::string::npos) << said;
  EXPECT_NE(said.find("1.5"), std::string::npos) << said;
}

TEST_F(MaterialImports, AMidlineInMillimetres) {
  const auto strips = import_cantilever(from("strip.csv", "along_mm,down_mm\n0,0\n10,1\n20,4\n29,9\n"));
  ASSERT_EQ(strips.trials.size(), 1u);
  const trial::Trial& t = strips.trials[0];
  EXPECT_EQ(t.name, "strip");
  EXPECT_NEAR(t.cantilever->midline_m(1, 2), 0.004, 1e-12);
  EXPECT_NEAR(t.cantilever->overhang_m, 0.03078, 1e-4);
  EXPECT_NEAR(trial::areal_mass(t), 0.4, 1e-12);
}

TEST_F(MaterialImports, ATableOfBendingLengths) {
  MaterialImport f = from("instrument.csv", "strip,angle,c\n1,0,21.5\n2,90,18\n");
  f.columns = {{"bending_length_mm", "c"}, {"angle_deg", "angle"}};
  const auto strips = import_cantilever(f);
  ASSERT_EQ(strips.trials.size(), 2u);
  EXPECT_EQ(strips.trials[1].name, "instrument-2");
  EXPECT_EQ(strips.trials[1].cantilever->angle_deg, 90);
  EXPECT_NEAR(strips.trials[0].cantilever->bending_length_m.value(), 0.0215, 1e-12);
  EXPECT_NEAR(strips.trials[0].cantilever->overhang_m, 0.043, 1e-12);
}

TEST_F(MaterialImports, PullsAsCsv) {
  MaterialImport f =
      from("pulls.csv", "pull,Load,extension_mm\n1,0,0\n1,1,2\n1,2,4\n1,3,6\n2,0,0\n2,1,2\n2,2,3\n2,3,5\n");
  f.columns = {{"force", "Load"}};
  f.gauge_m = 0.05;
  const trial::Trial t = import_tensile(f);
  ASSERT_EQ(t.tensile->pulls.size(), 2u);
  EXPECT_NEAR(t.tensile->pulls[0].stretch_along[3], 1.12, 1e-12);
  EXPECT_TRUE(std::isnan(t.tensile->pulls[0].stretch_across[3]));
  EXPECT_NE(refusal_of([&] { import_tensile(from("other.csv", "a,b\n1,2\n")); }).find("force"), std::string::npos);
}

TEST_F(MaterialImports, PullsAsHdf5) {
  const trial::Trial t = import_tensile(hdf5());
  ASSERT_EQ(t.tensile->pulls.size(), 2u);
  EXPECT_NEAR(t.tensile->width_m, 0.125, 1e-12);  // 250 px at 0.5 mm
  EXPECT_NEAR(t.tensile->length_m, 0.1, 1e-12);
  EXPECT_NEAR(t.tensile->pulls[0].stretch_along[3], 2, 1e-12);
  EXPECT_NEAR(t.tensile->pulls[0].stretch_across[3], 0.8, 1e-12);
  EXPECT_NEAR(t.tensile->pulls[0].time_s[3], 4 / 30.0, 1e-12);
  EXPECT_FALSE(t.fabric.mass_known);
  MaterialImport without = hdf5();
  without.hdf5.clamp_m.reset();
  EXPECT_NE(refusal_of([&] { import_tensile(without); }).find("--clamp-mm"), std::string::npos);
  EXPECT_NE(refusal_of([&] { import_tensile(hdf5({0, 1})); }).find("pulls.h5: video2: traj"), std::string::npos);
  MaterialImport none = from("none.h5", "no such file");
  none.hdf5.clamp_m = 0.05;
  EXPECT_NE(refusal_of([&] { import_tensile(none); }).find("none.h5"), std::string::npos);
}

TEST_F(MaterialImports, JoinOneCampaign) {
  const fs::path out = folder_ / "campaign";
  add_to_campaign(import_cantilever(from("one.csv", "along_mm,down_mm\n0,0\n10,1\n20,4\n29,9\n")).trials, out);
  add_to_campaign(import_cantilever(from("two.csv", "along_mm,down_mm\n0,0\n10,1\n20,4\n28,9\n")).trials, out);
  const trial::Campaign campaign = trial::read_campaign(out);
  ASSERT_EQ(campaign.trials.size(), 2u);
  EXPECT_EQ(campaign.trials[1].name, "two");
  const MaterialImport again = from("two.csv", "along_mm,down_mm\n0,0\n10,1\n20,4\n28,9\n");
  EXPECT_NE(refusal_of([&] { add_to_campaign(import_cantilever(again).trials, out); }).find("already"),
            std::string::npos);
  MaterialImport silk = from("silk.csv", "along_mm,down_mm\n0,0\n10,1\n20,4\n28,9\n");
  silk.fabric = "silk";
  EXPECT_NE(refusal_of([&] { add_to_campaign(import_cantilever(silk).trials, out); }).find("silk"), std::string::npos);
}

TEST_F(MaterialImports, MissingOptionsAreNamed) {
  MaterialImport f = from("strip.csv", "along_mm,down_mm\n0,0\n10,1\n20,4\n29,9\n");
  f.areal_mass.reset();
  EXPECT_NE(refusal_of([&] { import_cantilever(f); }).find("--areal-mass"), std::string::npos);
  f = from("photo.jpg", "no picture");
  EXPECT_NE(refusal_of([&] { import_cantilever(f); }).find("--mm-per-px"), std::string::npos);
  EXPECT_NEAR(mm_per_px_of("10,10,40,50=25"), 0.5, 1e-12);
  EXPECT_NE(refusal_of([&] { mm_per_px_of("10,10,40=25"); }).find("--scale"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::station
