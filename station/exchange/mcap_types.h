// The types of Foxglove's messages that a trial is told in, with what their JSON schemas say of them. Source:
// github.com/foxglove/foxglove-sdk, schemas/jsonschema.
#pragma once

#include <string>

namespace selvedge::station {

struct McapType {
  std::string name, schema;
};

McapType point_cloud_type();
McapType compressed_image_type();
McapType camera_calibration_type();
McapType frame_transform_type();
McapType pose_type();
McapType scene_update_type();

}  // namespace selvedge::station
