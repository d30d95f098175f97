#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/config/version.h"
#include "services/perception/tools/learn.h"

namespace chase::perception {

namespace {

cv::Mat Read(const std::string& file, cv::ImreadModes mode) {
  cv::Mat image = cv::imread(file, mode);
  if (image.empty()) throw std::runtime_error(file + ": cannot be read as an image");
  return image;
}

/// The config as text. Throws when the service would refuse it: each part of it is checked as it is
/// when it is loaded.
std::string Checked(const PerceptionConfig& config) {
  std::string text = config::Dump(config);
  PerceptionConfig loaded;
  try {
    config::LoadText(text, "learned", &loaded);
  } catch (const std::runtime_error& e) {
    throw std::runtime_error(std::string(e.what()) +
                             "; nothing is written, give pictures and masks of the whole target");
  }
  return text;
}

/// How well the learned colours separate target and background, as comments of the YAML file.
std::string Quality(const std::vector<std::string>& files, const Learned& learned) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(3)
      << "# Shares of pixels within the learned colours: of the target, of the background near it, "
         "of all of it.\n# The picture's separation: 1 where they part it wholly.\n";
  const auto& pictures = learned.color.pictures;
  for (size_t i = 0; i < pictures.size(); ++i) {
    const auto& p = pictures[i];
    out << "# " << files[2 * i] << ": target " << p.target << ", near " << p.near << ", all "
        << p.far << ", separation " << p.index
        << (p.used ? "" : "; left out of the colours: with it they separate worse") << "\n";
  }
  out << "# Mean overlap with the masks: " << learned.overlap << "\n";
  return out.str();
}

void Learn(const std::vector<std::string>& files, const std::string& base, const std::string& out) {
  if (files.size() % 2 != 0)  // one empty name where none is given
    throw std::invalid_argument("--learn-colour: give pairs of IMAGE MASK");
  PerceptionConfig config;
  if (!base.empty()) config::Load(base, &config);
  std::vector<cv::Mat> images, masks;
  for (size_t i = 0; i < files.size(); i += 2) {
    images.push_back(Read(files[i], cv::IMREAD_COLOR));
    masks.push_back(Read(files[i + 1], cv::IMREAD_GRAYSCALE));
  }
  const Learned learned = LearnDetector(images, masks, config.detector);
  config.detector = learned.config;
  config.state.acquire_score = learned.acquire_score;
  const std::string text = Quality(files, learned) + Checked(config);
  if (!(std::ofstream(out) << text))
    throw std::runtime_error(out + ": cannot be written; name a file in an existing folder");
  const auto& color = learned.config.color;
  std::printf(
      "%s: hue %.0f to %.0f degrees, saturation from %.2f, value from %.2f, inset %.2f; "
      "mean overlap with the masks %.3f\n",
      out.c_str(), color.hue_min_deg, color.hue_max_deg, color.saturation_min, color.value_min,
      learned.config.shape.inset, learned.overlap);
  std::fputs(Quality(files, learned).c_str(), stdout);
  for (const auto& pair : learned.shapeless)
    std::printf("not used for the shape: %s\n", pair.c_str());
}

}  // namespace

int LearnColour(int argc, char** argv) {
  CLI::App app("Learns the target's colour and shape from marked pictures.", "chase-perception");
  chase::config::AddVersion(&app);
  std::vector<std::string> files;
  std::string base, out = "perception.yaml";
  app.add_option("--learn-colour", files, "IMAGE MASK [IMAGE MASK ...]; masks not 0 on the target")
      // With one at least it takes --help for a file.
      ->expected(0, CLI::detail::expected_max_vector_size);
  app.add_option("--config", base, "YAML file that all else is taken from");
  app.add_option("--out", out, "config to write, for --config of the service");
  try {
    app.parse(argc, argv);
    Learn(files, base, out);
    return 0;
  } catch (const CLI::Success& e) {  // --help
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "chase-perception: %s; see chase-perception --learn-colour --help\n",
                 e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-perception: %s\n", e.what());
  }
  return 1;
}

}  // namespace chase::perception
