// The back-ends of cameras, which the reader of [camera] names but no fuzzer opens: their libraries stay out.
#include <stdexcept>

#include "rig/camera/camera.h"

namespace selvedge::camera {

std::unique_ptr<Camera> open_aravis_camera(const CameraConfiguration&) { throw std::logic_error("no camera here"); }
std::unique_ptr<Camera> open_v4l2_camera(const CameraConfiguration&) { throw std::logic_error("no camera here"); }

}  // namespace selvedge::camera
