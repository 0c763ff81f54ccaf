#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "integration/app/gpu.h"
#include "integration/app/outputs.h"
#include "integration/app/progress.h"
#include "integration/charts/felt_page.h"
#include "module/session/scene_picture.h"
#include "module/session/session.h"

namespace palpate::app {

struct GalleryOptions {
  DeviceOptions gpu;
  ViewChoices view;
  PictureSize size{384, 384};
  int pictures = 4;  ///< phases, evenly spread
};

/// Looks on while a scene is felt, without any display: draws both eyes again and again on a thread
/// of its own, as a headset would ask for it, and keeps one stereo picture per phase, in contact if
/// there was any.
class Gallery {
 public:
  /// Starts to look once the device is opened and the volumes are on it. `session` and `console`
  /// are borrowed.
  Gallery(Session& session, const GalleryOptions& options, Console& console);
  /// As stop().
  ~Gallery();
  Gallery(const Gallery&) = delete;
  Gallery& operator=(const Gallery&) = delete;

  void stop();
  /// Why there are no pictures: a sentence, or nothing. After stop().
  const std::string& trouble() const { return trouble_; }
  /// Frames drawn, and what they took, ms. After stop().
  size_t frames() const { return frame_ms_.size(); }
  double median_ms() const;
  double first_picture_s() const { return first_picture_s_; }

  /// Stages view_1.png, ... and page.png. After stop(). kBadOutput.
  Status stage(Outputs& outputs, const std::string& title, const std::string& subtitle,
               const charts::Timeline& timeline) const;

 private:
  struct Kept {
    bool any = false, touching = false, moving = false;
    double force_n = 0.0;
    charts::StereoView view;
  };
  void run(std::stop_token stop);
  Status look(std::stop_token stop);
  void keep(const SceneMoment& moment, const std::vector<charts::Raster>& pictures,
            const ViewScene& scene);

  Session& session_;
  GalleryOptions options_;
  Console& console_;
  std::vector<Kept> kept_;
  std::vector<double> frame_ms_;
  double first_picture_s_ = 0.0;
  std::string trouble_;
  std::jthread thread_;
};

}  // namespace palpate::app
