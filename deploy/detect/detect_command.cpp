#include "deploy/detect/detect_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/config/version.h"
#include "deploy/detect/picture.h"
#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Arguments {
  std::vector<std::string> inputs;
  std::string config, out, masks;
  bool json = false;
};

/// One picture, or one frame of a video.
struct Picture {
  std::string name;  ///< of the file, with the frame's number behind a #
  std::string stem;  ///< of its mask: the file's stem, with the frame's number behind a -
  cv::Mat bgr;
};

bool IsPicture(const fs::path& file) {
  static constexpr std::array<const char*, 8> kKinds = {".jpg", ".jpeg", ".png",  ".bmp",
                                                        ".ppm", ".tif",  ".tiff", ".webp"};
  std::string kind = file.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kKinds.begin(), kKinds.end(), kind) != kKinds.end();
}

bool IsMask(const fs::path& file) {
  const std::string stem = file.stem().string(), tail = "_mask";
  return stem.size() > tail.size() && stem.rfind(tail) == stem.size() - tail.size();
}

/// The file, or the pictures of a folder by name, without NAME_mask.png.
std::vector<std::string> FilesOf(const std::string& input) {
  if (!fs::exists(input)) throw std::runtime_error(input + ": no such file or folder");
  if (!fs::is_directory(input)) return {input};
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(input))
    if (IsPicture(entry.path()) && !IsMask(entry.path())) files.push_back(entry.path().string());
  if (files.empty()) throw std::runtime_error(input + ": holds no picture");
  std::sort(files.begin(), files.end());
  return files;
}

void ForEachPicture(const std::string& file, const std::function<void(const Picture&)>& show) {
  const std::string stem = fs::path(file).stem().string();
  if (IsPicture(file)) {
    const cv::Mat bgr = cv::imread(file, cv::IMREAD_COLOR);
    if (bgr.empty()) throw std::runtime_error(file + ": cannot be read as a picture");
    return show({file, stem, bgr});
  }
  cv::VideoCapture video(file);
  cv::Mat bgr;
  int frame = 0;
  for (; video.isOpened() && video.read(bgr); ++frame)
    show({fmt::format("{}#{}", file, frame), fmt::format("{}-{}", stem, frame), bgr});
  if (frame == 0) throw std::runtime_error(file + ": neither a picture nor a video");
}

/// NAME_mask.png or NAME.png in the folder of masks, but never the picture itself.
cv::Mat MaskFor(const Picture& picture, const std::string& folder) {
  const std::string& stem = picture.stem;
  for (const auto& name : {stem + "_mask.png", stem + ".png"}) {
    const fs::path file = fs::path(folder) / name;
    std::error_code missing;
    if (fs::equivalent(file, picture.name, missing)) continue;
    const cv::Mat mask = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    if (mask.empty()) continue;
    if (mask.size() == picture.bgr.size()) return mask;
    throw std::runtime_error(fmt::format("{}: the mask is {}x{}, the picture {}x{}", name,
                                         mask.cols, mask.rows, picture.bgr.cols, picture.bgr.rows));
  }
  throw std::runtime_error(
      fmt::format("{}: neither {}_mask.png nor {}.png in {}", picture.name, stem, stem, folder));
}

/// The outline of the target's region, px of the picture.
std::vector<cv::Point> Outline(const Detection& d) {
  if (d.mask.empty()) return {};
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(Region(d).clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE,
                   d.mask_box.tl());
  if (contours.empty()) return {};
  return *std::max_element(contours.begin(), contours.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
}

json ToJson(const Picture& picture, const std::optional<PictureTarget>& target) {
  json out{{"file", picture.name},
           {"width_px", picture.bgr.cols},
           {"height_px", picture.bgr.rows},
           {"detections", json::array()}};
  if (!target) return out;
  const Detection& d = target->detection;
  json found{{"box_px", {d.box.x, d.box.y, d.box.width, d.box.height}},
             {"score", d.score},
             {"outline_px", json::array()},
             {"range_m", nullptr},
             {"range_sigma_m", nullptr}};
  for (const auto& p : Outline(d)) found["outline_px"].push_back({p.x, p.y});
  if (target->range) found["range_m"] = *target->range;
  if (target->range_sigma) found["range_sigma_m"] = *target->range_sigma;
  out["detections"].push_back(found);
  return out;
}

std::string ToText(const std::optional<PictureTarget>& target) {
  if (!target) return "none";
  const auto& box = target->detection.box;
  std::string text = fmt::format("score {:.2f}, box {:.0f} {:.0f} {:.0f} {:.0f} px",
                                 target->detection.score, box.x, box.y, box.width, box.height);
  if (target->range)
    text += fmt::format(", range {:.2f} +- {:.2f} m", *target->range, *target->range_sigma);
  return text;
}

void WriteAnnotated(const Picture& picture, const std::optional<PictureTarget>& target,
                    const std::string& folder, std::set<std::string>* written) {
  fs::create_directories(folder);
  cv::Mat drawn = picture.bgr.clone();
  const int thick = std::max(1, drawn.rows / 240);
  if (target) {
    const auto outline = Outline(target->detection);
    if (!outline.empty())
      cv::polylines(drawn, std::vector<std::vector<cv::Point>>{outline}, true, {255, 255, 0},
                    thick);
    cv::rectangle(drawn, cv::Rect(target->detection.box), {0, 255, 0}, thick);
  }
  const std::string text = ToText(target);
  const double wide = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 1.0, 2, nullptr).width;
  const double scale = std::min(drawn.rows / 600.0, 0.95 * drawn.cols / wide);
  const cv::Point at(drawn.cols / 50, static_cast<int>(30.0 * scale) + 2);
  cv::putText(drawn, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, {0, 0, 0}, 3 * thick, cv::LINE_AA);
  cv::putText(drawn, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, {0, 255, 0}, thick, cv::LINE_AA);
  std::string name = fs::path(picture.name).filename().string();
  std::replace(name.begin(), name.end(), '#', '-');
  std::string unused = name;  // pictures of several folders may be called alike
  for (int i = 2; !written->insert(unused).second; ++i) unused = fmt::format("{}-{}", name, i);
  const std::string file = (fs::path(folder) / (unused + ".png")).string();
  if (!cv::imwrite(file, drawn)) throw std::runtime_error(file + ": cannot be written");
}

void PrintFigures(const Evaluation& e) {
  fmt::print("precision {:.3f} ({} of {}), recall {:.3f} ({} of {}), mean IoU {:.3f}\n",
             e.precision(), e.found, e.claimed, e.recall(), e.found, e.with_target,
             e.mean_overlap());
}

json ToJson(const Evaluation& e) {
  return {{"with_target", e.with_target}, {"claimed", e.claimed}, {"found", e.found},
          {"precision", e.precision()},   {"recall", e.recall()}, {"mean_iou", e.mean_overlap()}};
}

/// How many files could not be used, after a line on stderr for each.
int Run(const Arguments& a) {
  PerceptionConfig config;
  if (!a.config.empty()) config::Load(a.config, &config);
  PictureDetector detector(config);
  std::set<std::string> written;
  json pictures = json::array();
  Evaluation evaluation;
  int failed = 0;
  const auto attempt = [&failed](const std::function<void()>& what) {
    try {
      what();
    } catch (const std::exception& e) {
      fmt::print(stderr, "chase-detect: {}\n", e.what());
      ++failed;
    }
  };
  const auto show = [&](const Picture& picture) {
    const auto target = detector.Find(picture.bgr);
    if (!a.masks.empty()) evaluation.Add(target, MaskFor(picture, a.masks));
    if (!a.out.empty()) WriteAnnotated(picture, target, a.out, &written);
    if (a.json)
      pictures.push_back(ToJson(picture, target));
    else
      fmt::print("{}: {}\n", picture.name, ToText(target));
  };
  for (const auto& input : a.inputs)
    attempt([&] {
      for (const auto& file : FilesOf(input)) attempt([&] { ForEachPicture(file, show); });
    });
  json result{{"pictures", pictures}};
  if (!a.masks.empty()) result["evaluation"] = ToJson(evaluation);
  if (a.json)
    fmt::print("{}\n", result.dump(2));
  else if (!a.masks.empty())
    PrintFigures(evaluation);
  return failed;
}

}  // namespace

int Detect(int argc, char** argv) {
  CLI::App app("Finds the target in pictures and videos.", "chase-detect");
  chase::config::AddVersion(&app);
  Arguments a;
  app.add_option("inputs", a.inputs,
                 "pictures, folders of pictures (without NAME_mask.png), videos")
      ->required();
  app.add_option("--config", a.config,
                 "perception's YAML file, as --learn-colour writes it; with its rig the camera "
                 "that tells the range");
  app.add_flag("--json", a.json, "boxes, outlines, scores and ranges as JSON on stdout");
  app.add_option("--out", a.out, "folder for one annotated PNG a picture");
  app.add_option(
      "--evaluate", a.masks,
      "folder of masks NAME_mask.png or NAME.png (of a video's frames NAME-0_mask.png and so on), "
      "not 0 on the target: prints precision, recall and mean IoU; found is what overlaps by half");
  try {
    app.parse(argc, argv);
    return Run(a) > 0 ? 1 : 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-detect: {}; see chase-detect --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-detect: {}\n", e.what());
  }
  return 1;
}

}  // namespace chase::perception
