#include "common/logs/jpeg.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "common/bus/image_format.h"

namespace chase::logs {

std::string Jpeg(const camera_image_t& m, int quality) {
  if (m.pixelformat == bus::kPixelFormatMjpeg) return {m.data.begin(), m.data.end()};
  const bool grey = m.pixelformat == camera_image_t::PIXEL_FORMAT_GRAY;
  const int64_t row = int64_t{m.width} * (grey ? 1 : 3);
  if (m.width <= 0 || m.height <= 0 || m.row_stride < row ||
      int64_t{m.row_stride} * m.height > static_cast<int64_t>(m.data.size()))
    return "";
  cv::Mat image(m.height, m.width, grey ? CV_8UC1 : CV_8UC3, const_cast<uint8_t*>(m.data.data()),
                static_cast<size_t>(m.row_stride));
  if (m.pixelformat == camera_image_t::PIXEL_FORMAT_RGB) {
    cv::Mat turned;
    cv::cvtColor(image, turned, cv::COLOR_RGB2BGR);
    image = turned;
  }
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
  return {jpeg.begin(), jpeg.end()};
}

}  // namespace chase::logs
