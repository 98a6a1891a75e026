// A trial as MCAP: every record, index and checksum as the specification has them, and the numbers that were recorded.
#include <cstdlib>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/exchange/mcap_export.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

// Reads the file by the specification alone, the trial by its own files.
constexpr const char* kReadMcap = R"(
import base64, csv, json, struct, sys, zlib
trial, path = sys.argv[1:]
b = open(path, "rb").read()
magic = b"\x89MCAP0\r\n"
assert b[:8] == magic and b[-8:] == magic
def records(data, at, end):
    while at < end:
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield opcode, at, data[at + 9:at + 9 + length]
        at += 9 + length
    assert at == end
def text(c, at, size="<I"):
    n, = struct.unpack_from(size, c, at)
    at += struct.calcsize(size)
    return c[at:at + n], at + n
footer = b[-8 - 20:-8]
summary, offsets, crc = struct.unpack("<QQI", footer)
assert zlib.crc32(b[summary:-12]) == crc
data = list(records(b, 8, summary))
assert data[0][0] == 1 and data[-1][0] == 15
assert struct.unpack("<I", data[-1][2])[0] == zlib.crc32(b[:data[-1][1]])
topics, schemas, messages, places = {}, {}, [], {}
def know(opcode, c):
    if opcode == 3:
        number, = struct.unpack_from("<H", c); name, at = text(c, 2); kind, at = text(c, at); body, _ = text(c, at)
        schemas[number] = name.decode(); assert kind == b"jsonschema"; assert json.loads(body)["title"] == name.decode()
    if opcode == 4:
        number, schema = struct.unpack_from("<HH", c); topic, at = text(c, 4); kind, _ = text(c, at)
        topics[number] = (topic.decode(), schemas[schema]); assert kind == b"json"
chunks, about, indices = [], {}, 0
for opcode, at, c in data[1:-1]:
    if opcode == 6:
        first, last, size, crc = struct.unpack_from("<QQQI", c)
        compression, k = text(c, 28); inside, _ = text(c, k, "<Q")
        assert compression == b"" and len(inside) == size and zlib.crc32(inside) == crc
        chunks.append((at, inside)); times = []
        for o, p, m in records(inside, 0, size):
            know(o, m)
            if o == 5:
                channel, sequence, logged, published = struct.unpack_from("<HIQQ", m)
                assert logged == published and sequence == sum(x[0] == channel for x in messages)
                messages.append((channel, logged, json.loads(m[22:]))); places[len(chunks) - 1, p] = (channel, logged)
                times.append(logged)
        assert (min(times), max(times)) == (first, last)
    elif opcode == 7:
        channel, = struct.unpack_from("<H", c); pairs, _ = text(c, 2)
        for time, place in struct.iter_unpack("<QQ", pairs):
            assert places.pop((len(chunks) - 1, place)) == (channel, time); indices += 1
    elif opcode == 12:
        name, at = text(c, 0); pairs, _ = text(c, at); k = 0
        while k < len(pairs):
            key, k = text(pairs, k); value, k = text(pairs, k); about[key.decode()] = value.decode()
    else: raise AssertionError(opcode)
assert not places and indices == len(messages) and len(chunks) >= 1
groups = [struct.unpack("<BQQ", c) for o, _, c in records(b, offsets, len(b) - 8 - 29)]
for kind, at, length in groups:
    for o, _, c in records(b, at, at + length):
        assert o == kind
        if o == 11:
            counts = len(messages), len(schemas), len(topics), 0, 1, len(chunks)
            assert struct.unpack_from("<QHIIII", c) == counts
        if o == 8: assert struct.unpack_from("<Q", c, 16)[0] in [at for at, _ in chunks]
assert sorted(k for k, _, _ in groups) == [3, 4, 8, 11, 13]
assert about["trial"] == "trial" and about["simulated"] == "yes"

said = {}
for channel, time, m in messages:
    topic, kind = topics[channel]
    stamp = (m["entities"][0] if "entities" in m else m)["timestamp"]
    assert stamp["sec"] * 10**9 + stamp["nsec"] == time
    said.setdefault((topic, kind), []).append((time / 1e9, m))
assert [t for _, t, _ in messages] == sorted(t for _, t, _ in messages)
def table(name):
    return [[float(v) if v else None for v in row] for row in list(csv.reader(open(trial + "/" + name)))[1:]]
def points(m):
    fields = [f["name"] for f in m["fields"]]
    layout = "<fff" + "I" * (len(fields) - 3)
    return [dict(zip(fields, p)) for p in struct.iter_unpack(layout, base64.b64decode(m["data"]))]
near = lambda p, row: all(abs(p[a] - v) < 1e-6 for a, v in zip("xyz", row))
corners = said["/corners", "foxglove.PointCloud"]
for (time, m), row in zip(corners, table("corners.csv"), strict=True):
    assert abs(time - row[0] - 0.5) < 1e-8  # the first is at -0.5 s
    sides = [s for s in (row[1:4], row[4:7]) if s[0] is not None]
    assert len(points(m)) == len(sides) and all(near(p, s) for p, s in zip(points(m), sides))
markers = [p for _, m in said["/markers", "foxglove.PointCloud"] for p in points(m)]
for p, row in zip(markers, table("markers.csv"), strict=True): assert p["marker"] == row[1] and near(p, row[4:7])
images = said["/camera/image", "foxglove.CompressedImage"]
for (_, m), row in zip(images, table("frames.csv"), strict=True):
    assert base64.b64decode(m["data"])[:8] == b"\x89PNG\r\n\x1a\n"
calibration, = said["/camera/calibration", "foxglove.CameraCalibration"]
place, = said["/tf", "foxglove.FrameTransform"]
t, q = place[1]["translation"], place[1]["rotation"]
assert abs(t["x"] - 0.1) + abs(t["y"] + 1.5) + abs(t["z"] - 0.2) < 1e-9  # it looks along y
assert abs(abs(q["x"]) - 0.5**0.5) < 1e-9 and abs(abs(q["w"]) - 0.5**0.5) < 1e-9
assert all(abs(a - b) < 1e-9 for a, b in zip(calibration[1]["K"], [100, 0, 12, 0, 101, 8, 0, 0, 1]))
fabric = said["/fabric/simulated", "foxglove.SceneUpdate"]
assert [t for t, _ in fabric] == [0.5, 0.75]
triangles = fabric[1][1]["entities"][0]["triangles"][0]
assert triangles["indices"] == [0, 1, 2] and triangles["points"][2] == {"x": 0.3, "y": 0.25, "z": 1.0}
print("as recorded")
)";

class Mcap : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  // Its clock begins at half a second before; one corner is hidden once.
  trial::Trial written() {
    trial::Trial t;
    t.experiment = trial::Experiment::waving;
    t.fabric = {"denim", 0.3, 0.25, 0.021, true};
    t.camera = geometry::looking_at({0.1, -1.5, 0.2}, {0.1, 0, 0.2}, Eigen::Vector2d(100, 101), Eigen::Vector2d(12, 8),
                                    24, 16);
    t.frame_rate_hz = 30;
    t.exposure_s = 0.002;
    t.mocap_rate_hz = 120;
    trial::Markers markers;
    markers.position = Eigen::Matrix3Xd::Random(3, 8);
    for (int i = 0; i < 8; ++i) {
      t.corners.time_s.push_back(-0.5 + i / 4.0);
      markers.time_s.push_back(-0.5 + i / 2 / 4.0);
      markers.marker.push_back(3 + i % 2);
      markers.uv.emplace_back(0.1 * (i % 2), 0.1);
    }
    t.corners.left = t.corners.right = Eigen::Matrix3Xd::Random(3, 8);
    t.corners.left.col(3).setConstant(std::nan(""));
    t.markers = markers;
    t.frames = trial::Frames{{0, 1}, {0.01, 0.043}, {}};
    const trial::GreyImage grey = trial::GreyImage::Constant(16, 24, 99);
    trial::write_trial(t, folder_ / "trial", {grey, grey});
    return trial::read_trial(folder_ / "trial");
  }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-mcap-{}", ::getpid());
};

SimulatedMotion one_triangle() {
  SimulatedMotion motion;
  motion.uv_m = {{0, 0}, {0.3, 0}, {0, 0.25}};
  motion.triangles = {{0, 1, 2}};
  motion.time_s = {0, 0.25};
  motion.position.assign(2, Eigen::Matrix3Xf::Zero(3, 3));
  motion.position[1].col(2) = Eigen::Vector3f(0.3F, 0.25F, 1);
  return motion;
}

TEST_F(Mcap, IsAsItsSpecificationHasItAndHoldsWhatWasRecorded) {
  const McapExported out = export_mcap(written(), one_triangle(), folder_ / "trial.mcap");
  EXPECT_EQ(out.messages, 8u + 4u + 2u + 2u + 2u);
  EXPECT_NEAR(out.duration_s, 1.75, 1e-9);
  files::write_whole(folder_ / "read.py", kReadMcap);
  const int status = std::system(
      fmt::format("/usr/bin/python3 '{0}/read.py' '{0}/trial' '{0}/trial.mcap' > '{0}/output' 2>&1", folder_.string())
          .c_str());
  EXPECT_EQ(status, 0) << files::read_whole(folder_ / "output");
}

TEST_F(Mcap, LeavesNothingHalfWritten) {
  const trial::Trial t = written();
  fs::remove(t.frames->path[1]);
  EXPECT_ANY_THROW(export_mcap(t, {}, folder_ / "trial.mcap"));
  EXPECT_THROW(export_mcap(t, {}, folder_ / "nowhere" / "trial.mcap"), BadInput);
  trial::Trial late = t;
  late.corners.time_s.back() = 1e300;
  EXPECT_THROW(export_mcap(late, {}, folder_ / "trial.mcap"), BadInput);
  for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_EQ(entry.path().filename(), "trial");
}

}  // namespace
}  // namespace selvedge::station
