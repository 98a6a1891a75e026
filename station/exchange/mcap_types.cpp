#include "station/exchange/mcap_types.h"

#include <nlohmann/json.hpp>

namespace selvedge::station {

namespace {

using nlohmann::json;

json number() { return {{"type", "number"}}; }
json whole() { return {{"type", "integer"}}; }
json text() { return {{"type", "string"}}; }
json truth() { return {{"type", "boolean"}}; }
json bytes() { return {{"type", "string"}, {"contentEncoding", "base64"}}; }

json list_of(const json& items) { return {{"type", "array"}, {"items", items}}; }
json object_of(const char* title, const json& properties) {
  return {{"title", title}, {"type", "object"}, {"properties", properties}};
}

json seconds(const char* title) { return object_of(title, {{"sec", whole()}, {"nsec", whole()}}); }
json point(const char* title) { return object_of(title, {{"x", number()}, {"y", number()}, {"z", number()}}); }
json turn() {
  return object_of("foxglove.Quaternion", {{"x", number()}, {"y", number()}, {"z", number()}, {"w", number()}});
}
json pose() { return object_of("foxglove.Pose", {{"position", point("foxglove.Vector3")}, {"orientation", turn()}}); }

// A message: when, and in which frame, beside this.
McapType type_of(const std::string& name, json properties) {
  properties["timestamp"] = seconds("time");
  return {"foxglove." + name, object_of(("foxglove." + name).c_str(), properties).dump()};
}

}  // namespace

McapType point_cloud_type() {
  const json field =
      object_of("foxglove.PackedElementField", {{"name", text()}, {"offset", whole()}, {"type", whole()}});
  return type_of("PointCloud", {{"frame_id", text()},
                                {"pose", pose()},
                                {"point_stride", whole()},
                                {"fields", list_of(field)},
                                {"data", bytes()}});
}

McapType compressed_image_type() {
  return type_of("CompressedImage", {{"frame_id", text()}, {"data", bytes()}, {"format", text()}});
}

McapType camera_calibration_type() {
  return type_of("CameraCalibration", {{"frame_id", text()},
                                       {"width", whole()},
                                       {"height", whole()},
                                       {"distortion_model", text()},
                                       {"D", list_of(number())},
                                       {"K", list_of(number())},
                                       {"R", list_of(number())},
                                       {"P", list_of(number())}});
}

McapType frame_transform_type() {
  return type_of("FrameTransform", {{"parent_frame_id", text()},
                                    {"child_frame_id", text()},
                                    {"translation", point("foxglove.Vector3")},
                                    {"rotation", turn()}});
}

McapType pose_type() { return type_of("PoseInFrame", {{"frame_id", text()}, {"pose", pose()}}); }

McapType scene_update_type() {
  const json color = object_of("foxglove.Color", {{"r", number()}, {"g", number()}, {"b", number()}, {"a", number()}}),
             triangles = object_of("foxglove.TriangleListPrimitive", {{"pose", pose()},
                                                                      {"points", list_of(point("foxglove.Point3"))},
                                                                      {"color", color},
                                                                      {"colors", list_of(color)},
                                                                      {"indices", list_of(whole())}}),
             pair = object_of("foxglove.KeyValuePair", {{"key", text()}, {"value", text()}});
  json entity = {{"timestamp", seconds("time")},    {"frame_id", text()},      {"id", text()},
                 {"lifetime", seconds("duration")}, {"frame_locked", truth()}, {"metadata", list_of(pair)},
                 {"triangles", list_of(triangles)}};
  // None of them is written; a viewer looks for each.
  for (const char* other : {"arrows", "cubes", "spheres", "cylinders", "lines", "texts", "models"})
    entity[other] = list_of({{"type", "object"}});
  const json deletion = object_of("foxglove.SceneEntityDeletion",
                                  {{"timestamp", seconds("time")}, {"type", whole()}, {"id", text()}}),
             update = object_of(
                 "foxglove.SceneUpdate",
                 {{"deletions", list_of(deletion)}, {"entities", list_of(object_of("foxglove.SceneEntity", entity))}});
  return {"foxglove.SceneUpdate", update.dump()};
}

}  // namespace selvedge::station
