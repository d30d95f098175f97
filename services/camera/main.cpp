#include "common/bus/run_service.h"
#include "services/camera/camera_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::camera::CameraNode, chase::camera::CameraConfig>(
      "camera", "Publishes frames of a camera, a video or a folder of images.", argc, argv,
      "a camera hears no channel, so that no log moves it; a video or a folder of images is played "
      "as source, see --dump-config");
}
