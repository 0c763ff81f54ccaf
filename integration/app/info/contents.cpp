#include "integration/app/info/contents.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "compute/volume/no_data.h"
#include "integration/app/info/values.h"
#include "integration/app/progress.h"
#include "integration/app/session_flags.h"
#include "integration/app/summary.h"
#include "integration/files/dicom/dicom_frames.h"
#include "integration/files/frame_source.h"
#include "integration/files/frames.h"
#include "integration/files/landmarks.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "integration/files/scene/calibration_file.h"
#include "integration/files/scene/json_object.h"
#include "integration/files/scene/scene_file.h"
#include "integration/files/segmentation.h"
#include "integration/files/sentences.h"
#include "integration/files/sequence_motion_file.h"
#include "integration/files/text.h"
#include "integration/loading/replay_key.h"
#include "integration/loading/tubes_file.h"
#include "integration/x3d/x3d_file.h"
#include "module/haptics/servo/recording.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

// Limits beyond which something is unusual, but not wrong.
constexpr double kAnisotropic = 5.0;  // coarsest spacing / finest
constexpr double kUneven = 0.1;       // of the mean step between frames
constexpr double kAxis = 1e-3;        // rad: an axis is along the patient's
constexpr std::string_view kRecording = "palpate-ticks";

std::string type_name(SampleType type) {
  if (type == SampleType::kFloat) return "32-bit numbers";
  if (type == SampleType::kDouble) return "64-bit numbers";
  const bool is_unsigned = type == SampleType::kUint8 || type == SampleType::kUint16 ||
                           type == SampleType::kUint32 || type == SampleType::kUint64;
  return fmt::format("{}-bit {}integers", 8 * files::bytes_of(type),
                     is_unsigned ? "unsigned " : "");
}

std::string format_text(const std::string& format, const files::Raster& raster) {
  std::string text = format + ", " + type_name(raster.type);
  if (raster.encoding == files::Encoding::kDeflate) text += ", packed";
  if (raster.encoding == files::Encoding::kText) text += ", as text";
  if (raster.encoding == files::Encoding::kHex) text += ", as hexadecimal text";
  if (raster.slope != 1.0 || raster.intercept != 0.0)
    text += fmt::format(", value = {:.6g} x sample + {:.6g}", raster.slope, raster.intercept);
  return text;
}

// What is suspicious ------------------------------------------------------------------------------

void judge_grid(const Grid& grid, std::vector<std::string>& problems) {
  const glm::dvec3 s = grid.spacing_mm;
  const double finest = grid.finest_mm(), coarsest = std::max({s.x, s.y, s.z});
  if (coarsest > kAnisotropic * finest)
    problems.push_back(fmt::format(
        "Voxels are {:.1f} times as long as wide: motion along their long side is found less "
        "exactly.",
        coarsest / finest));
  for (std::string& unusual : files::unusual_place(grid)) problems.push_back(std::move(unusual));
  const int thin = std::min({grid.size.x, grid.size.y, grid.size.z});
  if (thin == 1) problems.push_back("It is a single slice: motion through it can not be seen.");
}

void judge_times(const std::vector<double>& times, std::vector<std::string>& problems) {
  if (times.size() < 3) return;
  const double mean = (times.back() - times.front()) / double(times.size() - 1);
  double least = times.back() - times.front(), most = 0.0;
  for (size_t k = 1; k < times.size(); ++k) {
    least = std::min(least, times[k] - times[k - 1]);
    most = std::max(most, times[k] - times[k - 1]);
  }
  if (most - least > kUneven * mean)
    problems.push_back(
        fmt::format("Its frames are {:.4g} to {:.4g} s apart: the times are uneven.", least, most));
}

std::string of_frame(size_t k, size_t count) {
  return count > 1 ? fmt::format("Frame {}", k) : std::string("It");
}

/// Checks whether values are finite, of scalars and vectors.
void judge_finite(const std::vector<Values>& values, std::vector<std::string>& problems) {
  for (size_t k = 0; k < values.size(); ++k) {
    const Values& v = values[k];
    if (v.not_finite == 0) continue;
    problems.push_back(fmt::format(
        "{} holds {} not finite (NaN or Inf), the first at voxel ({}, {}, {}): palpate refuses it "
        "until they are replaced; --nan-as VALUE replaces NaN.",
        of_frame(k, values.size()),
        v.not_finite == 1 ? std::string("1 value that is")
                          : fmt::format("{} values that are", v.not_finite),
        v.first_not_finite.x, v.first_not_finite.y, v.first_not_finite.z));
  }
}

void judge_scalars(const std::vector<Values>& values, std::vector<std::string>& problems) {
  for (size_t k = 0; k < values.size(); ++k) {
    const Values& v = values[k];
    if (v.count > v.not_finite && v.low == v.high)
      problems.push_back(
          fmt::format("{} holds the value {:.6g} everywhere: there is nothing to see "
                      "or feel.",
                      of_frame(k, values.size()), v.low));
    else if (k > 0 && v.hash == values[k - 1].hash)
      problems.push_back(
          fmt::format("Frames {} and {} are equal: nothing moves between them.", k - 1, k));
  }
}

/// Tells how much of the volume lies outside of what was scanned. Only files with such a border are
/// read once more to the end.
void describe_no_data(Contents& contents) {
  if (contents.kind != "volume" && contents.kind != "sequence") return;
  auto reader = files::SequenceReader::open({contents.path});
  NoDataFinder finder;
  std::optional<Mask> found;
  for (size_t k = 0; reader && k < reader->frame_count(); ++k) {
    const auto frame = reader->frame(k);
    if (!frame || glm::any(glm::lessThan(frame->grid.size, glm::ivec3(2)))) return;
    finder.add(*frame);
    if (k > 0 && k + 1 < reader->frame_count()) continue;
    found = finder.found();
    if (!found) return;
  }
  if (found)
    contents.more.emplace_back(
        "Outside", fmt::format("{:.0f} % of the voxels lie outside of what was scanned: one value "
                               "in all frames",
                               100.0 * share_of(*found)));
}

// Images ------------------------------------------------------------------------------------------

/// A mask has 0 and one other value; labels are a few integers, 0 among them.
bool are_labels(const Values& values) {
  const auto& different = values.different;
  return values.not_finite == 0 && values.whole && different.size() > 1 &&
         different.front() == 0.0F;
}

/// Says that some of several frames are no images.
void judge_labels(size_t labels, size_t frames, std::vector<std::string>& problems) {
  if (labels > 0 && labels < frames)
    problems.push_back(fmt::format(
        "{} of its {} frames hold masks or labels, the others do not: move those into a folder of "
        "their own.",
        labels, frames));
}

void describe_labels(const Values& values, Contents& contents) {
  const bool mask = values.different.size() == 2;
  contents.kind = mask ? "mask" : "labels";
  contents.what =
      mask ? "a mask" : fmt::format("labels ({} different whole numbers)", values.different.size());
  contents.use =
      "--mask of 'palpate motion' and 'palpate check', where what is not 0 counts; --segments of "
      "'palpate feel', where each label is a wall; as a volume, too";
}

/// Names, colours and sizes of the segments in a segmentation of 3D Slicer.
Status describe_segments(Contents& contents) {
  const auto read = files::read_segmentation(contents.path);
  if (!read) return read.error();
  const files::Segmentation& segmentation = read->front();
  contents.kind = "segmentation";
  contents.what = fmt::format("a segmentation of {} segment{}", segmentation.parts.size(),
                              segmentation.parts.size() == 1 ? "" : "s");
  contents.use = "--segments of 'palpate feel' and 'palpate view': its segments are walls";
  const glm::dvec3 edges = segmentation.grid.spacing_mm;
  for (const files::LabelledPart& part : segmentation.parts) {
    const std::vector<int32_t>& layer = segmentation.layers[part.layer];
    const auto voxels = std::count(layer.begin(), layer.end(), part.label);
    contents.more.emplace_back(
        "Segment",
        fmt::format("{}: label {}{}, colour {:.2g} {:.2g} {:.2g}, {:.4g} ml", part.name, part.label,
                    segmentation.layers.size() > 1 ? fmt::format(" of layer {}", part.layer)
                                                   : std::string(),
                    part.colour.r, part.colour.g, part.colour.b,
                    1e-3 * double(voxels) * edges.x * edges.y * edges.z));
  }
  return Nothing{};
}

/// Sets kind, what and use for scalar frames.
void describe_scalars(Contents& contents) {
  if (contents.frames > 1) {
    contents.kind = "sequence";
    contents.what = fmt::format("a sequence of {} frames", contents.frames);
    contents.use =
        "'palpate motion' finds its motion; 'palpate feel' lets it be felt while it is found";
  } else if (!contents.values.empty() && are_labels(contents.values.front())) {
    describe_labels(contents.values.front(), contents);
  } else {
    contents.kind = "volume";
    contents.what = "a volume";
    contents.use = "a frame for 'palpate motion'; its surface is felt by 'palpate feel'";
  }
  contents.memory_bytes = 4.0 * double(contents.grid->count()) * double(contents.frames);
  judge_scalars(contents.values, contents.problems);
  describe_no_data(contents);
}

/// Describes the vectors of one file, a displacement field or a flow.
Status describe_vectors(Contents& contents) {
  contents.kind = "vectors";
  contents.what = "vectors: a displacement field or a flow";
  contents.use =
      "taken for a displacement field in mm by 'palpate check' and --fields, for a flow by "
      "'palpate feel'";
  contents.memory_bytes = 12.0 * double(contents.grid->count());
  // So far the values are those of single components, which only show whether all are finite.
  if (contents.values.front().not_finite > 0) return Nothing{};
  auto field = files::read_field(contents.path);
  if (!field) return field.error();
  Volume lengths{field->grid, {}};
  for (const glm::vec3& u : field->u_mm) lengths.values.push_back(glm::length(u));
  contents.values = {values_of(lengths)};
  const Values& values = contents.values.front();
  contents.folds = folds(*field);
  const glm::dvec3 edges = field->grid.spacing_mm * glm::dvec3(field->grid.size);
  if (contents.folds->folded > 0)
    contents.problems.push_back(
        fmt::format("As a displacement field it folds at {} of {} voxels, which no tissue does.",
                    contents.folds->folded, contents.folds->voxels));
  if (values.high > glm::length(edges))
    contents.problems.push_back(fmt::format(
        "As a displacement field it moves by up to {:.4g} mm, further than the volume is large: "
        "is its unit mm?",
        values.high));
  if (values.high == 0.0F)
    contents.problems.push_back("All vectors have the length 0: nothing moves, nothing is felt.");
  return Nothing{};
}

Result<Contents> contents_of_image(const fs::path& path, const OnShare& on_share) {
  const auto raster = files::read_raster_header(path);
  if (!raster) return raster.error();
  Contents contents;
  contents.path = path;
  const files::RasterFormat* format = files::raster_format_of(path);
  contents.format = format_text(format != nullptr ? format->name : "unknown", *raster);
  contents.grid = raster->grid;
  contents.frames = raster->frame_count();
  contents.components = raster->component_count();
  if (raster->times_known) contents.times_s = raster->times_s;
  auto values = values_of(*raster, on_share);
  if (!values) return values.error();
  contents.values = std::move(*values);
  judge_grid(raster->grid, contents.problems);
  for (const std::string& note : raster->notes) contents.problems.push_back(note);
  judge_times(contents.times_s, contents.problems);
  judge_finite(contents.values, contents.problems);
  if (files::is_slicer_segmentation(contents.path)) {
    if (const Status done = describe_segments(contents); !done) return done.error();
  } else if (files::is_colour_picture(*raster)) {
    contents.kind = "picture";
    contents.what = "a colour picture";
    contents.use = "none: convert it to one gray value per voxel";
  } else if (contents.components == 3) {
    if (const Status done = describe_vectors(contents); !done) return done.error();
  } else if (contents.components > 1) {
    contents.kind = "components";
    contents.what = fmt::format("{} values per voxel", contents.components);
    contents.use = "none: export one component as a gray image";
  } else {
    describe_scalars(contents);
  }
  return contents;
}

/// One motion for a whole sequence: lengths and folds at every frame.
Result<Contents> contents_of_sequence_motion(const fs::path& path, const OnShare& on_share) {
  const auto motion = files::read_sequence_motion(path);
  if (!motion) return motion.error();
  const TimeBasis& basis = motion->basis;
  Contents contents{.path = path,
                    .kind = "sequence motion",
                    .what = fmt::format("one motion for a sequence of {} frames", motion->frames()),
                    .format = "NRRD, 32-bit numbers"};
  contents.grid = motion->terms.front().grid;
  contents.frames = motion->frames();
  contents.components = 3;
  contents.times_s = basis.times_s;
  contents.memory_bytes = 12.0 * double(motion->terms.size()) * double(contents.grid->count());
  contents.use =
      "--fields of 'palpate feel', 'palpate view' and 'palpate plan', motions of a scene; for "
      "'palpate check'";
  contents.more.emplace_back("Reference", fmt::format("frame {}", motion->reference));
  contents.more.emplace_back("Time", fmt::format("{}, {} terms", time_text(basis), basis.terms()));
  contents.folds = Folds{};
  for (size_t k = 0; k < motion->frames(); ++k) {
    const Field field = motion->at_frame(k);
    Volume lengths{field.grid, {}};
    for (const glm::vec3& u : field.u_mm) lengths.values.push_back(glm::length(u));
    contents.values.push_back(values_of(lengths));
    const Folds found = folds(field);
    contents.folds->voxels += found.voxels;
    contents.folds->folded += found.folded;
    contents.folds->min_det = std::min(contents.folds->min_det, found.min_det);
    on_share(double(k + 1) / double(motion->frames()));
  }
  judge_times(contents.times_s, contents.problems);
  if (contents.folds->folded > 0)
    contents.problems.push_back(
        fmt::format("It folds at {} of {} samples of all frames, which no tissue does.",
                    contents.folds->folded, contents.folds->voxels));
  return contents;
}

/// Several images in a folder of DICOM files, a line each.
void list_series(const std::vector<files::DicomEntry>& series, Contents& contents) {
  for (const files::DicomEntry& entry : series)
    contents.more.emplace_back("Series", entry.label + ": " + entry.what);
}

/// DICOM images none of which is meant before the others: the list to choose from.
Contents contents_of_study(const fs::path& folder, const std::vector<files::DicomEntry>& series,
                           const Error& why) {
  Contents contents{.path = folder,
                    .kind = "study",
                    .what = fmt::format("a folder of {} DICOM images", series.size()),
                    .format = "DICOM"};
  contents.use = "choose one with --series NUMBER or NAME";
  contents.problems.push_back(why.message + ".");
  list_series(series, contents);
  return contents;
}

/// A folder of slices or of 3D files, or a DICOM file, as the reader interprets it.
Result<Contents> contents_of_frames(const fs::path& input, const std::string& format,
                                    const OnShare& on_share) {
  const bool is_study = format == "DICOM" && fs::is_directory(input);
  using Entries = std::vector<files::DicomEntry>;
  const auto series = is_study ? files::list_dicom(input) : Result<Entries>(Entries());
  auto reader = files::SequenceReader::open({input});
  if (!reader && series && series->size() > 1)
    return contents_of_study(input, *series, reader.error());
  if (!reader) return reader.error();
  Contents contents;
  if (!reader->ordered_by().empty())
    contents.more.emplace_back("Order", "by " + reader->ordered_by());
  if (series && series->size() > 1) list_series(*series, contents);
  contents.path = input;
  contents.format = format;
  contents.grid = reader->grid();
  contents.frames = reader->frame_count();
  contents.components = 1;
  if (reader->times_known()) contents.times_s = reader->times_s();
  for (size_t k = 0; k < reader->frame_count(); ++k) {
    const auto frame = reader->frame(k);
    if (!frame) return frame.error();
    contents.values.push_back(values_of(*frame));
    on_share(double(k + 1) / double(reader->frame_count()));
  }
  judge_grid(*contents.grid, contents.problems);
  for (const std::string& note : reader->notes()) {
    if (format == "DICOM")
      contents.more.emplace_back("Note", note);
    else
      contents.problems.push_back(note);
  }
  judge_times(contents.times_s, contents.problems);
  const auto labels = std::count_if(contents.values.begin(), contents.values.end(), are_labels);
  judge_labels(size_t(labels), contents.frames, contents.problems);
  describe_scalars(contents);
  return contents;
}

/// A folder whose files contain vectors, as palpate motion writes it: the whole, then each field.
Result<Contents> contents_of_fields(const fs::path& folder, const std::vector<fs::path>& fields,
                                    const OnShare& on_share) {
  Contents contents;
  contents.path = folder;
  contents.kind = "fields";
  contents.what = fmt::format("a folder with {} fields", fields.size());
  contents.use = "--fields of 'palpate feel' and 'palpate plan'; for 'palpate check', each or all";
  contents.frames = fields.size();
  if (files::holds_sequence_motion(folder / files::kSequenceMotionName))
    contents.more.emplace_back(
        "Motion", fmt::format("one for the whole sequence, in {}: that is what is felt",
                              files::kSequenceMotionName));
  contents.components = 3;
  for (const fs::path& file : fields) {
    auto one = contents_of_image(file, on_share);
    if (!one) return one.error();
    if (!contents.grid) {
      contents.grid = one->grid;
      contents.format = one->format;
      contents.folds = Folds{};
    } else if (!same_geometry(*one->grid, *contents.grid)) {
      contents.problems.push_back(fmt::format("'{}' has {}.", file.filename().string(),
                                              files::difference(*one->grid, *contents.grid)));
    }
    for (const std::string& problem : one->problems)
      contents.problems.push_back(fmt::format("'{}': {}", file.filename().string(), problem));
    contents.values.push_back(one->values.front());
    contents.memory_bytes += one->memory_bytes;
    if (!one->folds) continue;
    contents.folds->voxels += one->folds->voxels;
    contents.folds->folded += one->folds->folded;
    contents.folds->min_det = std::min(contents.folds->min_det, one->folds->min_det);
  }
  return contents;
}

/// Files that are not frames of one sequence: each one on its own, and why they are no sequence.
Result<Contents> contents_of_different(const fs::path& folder, const std::vector<fs::path>& images,
                                       const Error& why, const OnShare& on_share) {
  Contents contents{.path = folder,
                    .kind = "folder",
                    .what = fmt::format("a folder of {} images", images.size()),
                    .format = fmt::format("{} image files", images.size())};
  contents.use = "none as a whole: name the files that you mean";
  contents.problems.push_back(fmt::format("It is no sequence: {}.", why.message));
  size_t labels = 0;
  for (const fs::path& image : images) {
    const std::string name = image.filename().string();
    const auto one = contents_of_image(image, on_share);
    if (!one) return one.error();
    labels += one->kind == "mask" || one->kind == "labels" ? 1 : 0;
    contents.more.emplace_back(
        "Holds", fmt::format("{}: {}, {}", name, one->what, files::grid_text(*one->grid)));
    for (const std::string& problem : one->problems)
      contents.problems.push_back(fmt::format("'{}': {}", name, problem));
  }
  // A mask or two beside images are usual, and no series of frames.
  if (labels > 2) judge_labels(labels, images.size(), contents.problems);
  return contents;
}

Result<Contents> contents_of_folder(const fs::path& folder, const OnShare& on_share) {
  const std::vector<fs::path> images = files::images_in(folder);
  if (images.empty()) return contents_of_frames(folder, "DICOM", on_share);
  if (const Status alike = files::check_one_kind(folder, images); !alike) return alike.error();
  std::vector<fs::path> motions;
  for (const fs::path& image : images)
    if (image.filename().string().starts_with("motion_")) motions.push_back(image);
  if (!motions.empty()) return contents_of_fields(folder, motions, on_share);
  if (files::holds_vectors({folder})) return contents_of_fields(folder, images, on_share);
  if (images.size() == 1) return contents_of_image(images.front(), on_share);
  auto frames = contents_of_frames(folder, fmt::format("{} image files", images.size()), on_share);
  return frames ? frames : contents_of_different(folder, images, frames.error(), on_share);
}

// Other files -------------------------------------------------------------------------------------

std::string start_of(const fs::path& path) {
  std::string bytes(4096, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(size_t(stream.gcount()));
  return bytes;
}

Result<Contents> contents_of_scene(const fs::path& path) {
  Contents contents{.path = path, .kind = "scene", .what = "a scene", .format = "JSON"};
  Result<SceneSpec> scene = SceneSpec{};
  if (x3d::is_x3d(path)) {
    auto read = x3d::read_x3d(path);
    if (!read) return read.error();
    contents.format = "X3D";
    for (const std::string& note : read->notes)
      contents.more.emplace_back("Note", with_flags(note));
    scene = std::move(read->spec);
  } else {
    scene = files::read_scene(path);
  }
  if (!scene) return scene.error();
  contents.use = "'palpate feel' lets it be felt; 'palpate plan' says what it needs";
  for (const VolumeSpec& volume : scene->volumes)
    contents.more.emplace_back(
        "Volume",
        fmt::format("{}: {}", volume.name,
                    volume.source.empty() ? fmt::format("{} files or folders", volume.files.size())
                                          : "synthetic data, " + volume.source));
  for (const ModeSpec& mode : scene->modes)
    contents.more.emplace_back(
        "Mode", fmt::format("{}: {} of {}, up to {:.3g} N", mode.name, mode.kind, mode.volume,
                            std::min(mode.strength.highest(), scene->max_force_n)));
  return contents;
}

Result<Contents> contents_of_calibration(const fs::path& path) {
  const auto stored = files::read_calibration(path);
  if (!stored) return stored.error();
  Contents contents{.path = path, .kind = "calibration", .what = "a calibration", .format = "JSON"};
  contents.use = "--calibration of 'palpate feel', in the room in which it was made";
  const Calibration& c = stored->calibration;
  contents.more.emplace_back("Device", stored->device);
  contents.more.emplace_back("Headset", stored->headset + " through " + stored->runtime);
  contents.more.emplace_back(
      "Fit", fmt::format("{} of {} points agree to {:.2g} mm (RMS), in the {} space", c.used, c.all,
                         1e3 * c.rms_m, stored->space));
  if (c.rms_m > 0.003)
    contents.problems.push_back("Its points agree to worse than 3 mm: calibrate again.");
  return contents;
}

Result<Contents> contents_of_json(const fs::path& path) {
  constexpr uintmax_t kMostBytes = 16 << 20;
  std::error_code error;
  if (fs::file_size(path, error) > kMostBytes)
    return files::bad_input(path, "is too large to be a scene or a calibration: check the name");
  std::ifstream stream(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  files::JsonReading reading{path, {}, nullptr};
  const auto root = files::parse_json(text, reading);
  if (!root) return *reading.error;
  if (root->contains("volumes") || root->contains("modes")) return contents_of_scene(path);
  if (root->contains("stage_from_device")) return contents_of_calibration(path);
  if (root->contains("program") && (root->contains("pairs") || root->contains("sequence"))) {
    Contents contents{
        .path = path, .kind = "summary", .what = "a summary of 'palpate motion'", .format = "JSON"};
    contents.use = "none: it is for people and programs";
    return contents;
  }
  return files::bad_input(path, "is neither a scene nor a calibration: check the name");
}

Result<Contents> contents_of_recording(const fs::path& path) {
  const auto recording = Recording::read(path);
  if (!recording) return recording.error();
  Contents contents{
      .path = path, .kind = "recording", .what = "a recording of the loop", .format = "palpate's"};
  contents.use = "'palpate feel SCENE --replay' with the scene it was made of";
  contents.more.emplace_back(
      "Ticks", fmt::format("{} in {:.4g} s", recording->ticks(),
                           1e-9 * double(recording->period_ns()) * double(recording->ticks())));
  if (const auto key = loading::parse_replay_key(path, recording->scene())) {
    std::vector<std::string> names;
    for (const VolumeSpec& volume : key->scene.volumes) names.push_back(volume.name);
    contents.more.emplace_back("Scene", fmt::format("{}", fmt::join(names, ", ")));
  }
  if (recording->lost() > 0)
    contents.problems.push_back(fmt::format(
        "{} ticks were lost while it was made: a replay gives other bits.", recording->lost()));
  return contents;
}

/// Stream tubes that the hand released; any other VTK file is none of palpate's.
Result<Contents> contents_of_tubes(const fs::path& path) {
  Contents contents{.path = path,
                    .kind = "tubes",
                    .what = "stream tubes that the hand released",
                    .format = "VTK, polydata"};
  contents.use = "none in palpate: ParaView and 3D Slicer show it";
  std::ifstream stream(path);
  size_t points = 0, lines = 0;
  for (std::string line; lines == 0 && std::getline(stream, line);) {
    const auto cells = files::words(line);
    if (cells.size() < 2) continue;
    const size_t count = size_t(std::max<int64_t>(0, files::to_integer(cells[1]).value_or(0)));
    if (cells[0] == "POINTS") points = count;
    if (cells[0] == "LINES") lines = count;
  }
  contents.more.emplace_back("Tubes", fmt::format("{} with {} points", lines, points));
  return contents;
}

/// The number of frames in which a table tracks its points.
size_t followed_frames(const fs::path& path) {
  size_t frames = 0;
  while (files::read_followed_points(path, int(frames))) ++frames;
  return frames;
}

Result<Contents> contents_of_table(const fs::path& path, const std::string& start) {
  Contents contents{.path = path, .format = "table"};
  // Column names are in the first line that is no comment.
  std::string_view rest = start;
  std::string_view names;
  while (!rest.empty() && (names.empty() || names.starts_with('#')))
    names = files::trimmed(files::take_line(rest));
  if (names.starts_with("t_s,x_m,")) {
    contents.kind = "path";
    contents.what = "a path of the simulated hand";
    contents.use = "--path of 'palpate feel'";
    return contents;
  }
  if (names.starts_with("t_s,") || names.starts_with("tick,")) {
    contents.kind = "ticks";
    contents.what =
        names.starts_with("tick,") ? "the ticks around a fault" : "ticks that were felt";
    contents.use = "none: it is for people and programs";
    return contents;
  }
  const size_t frames = followed_frames(path);
  const auto points =
      frames > 0 ? files::read_followed_points(path, 0) : files::read_landmarks(path);
  if (!points) return points.error();
  const auto& all = points->points_lps_mm;
  contents.kind = frames > 0 ? "followed points" : "landmarks";
  contents.what = frames > 0
                      ? fmt::format("{} points followed through {} frames", all.size(), frames)
                      : fmt::format("{} landmarks", all.size());
  contents.use = frames > 0 ? "--points of 'palpate check', with --frames"
                            : "--landmarks of 'palpate check' and 'palpate chart'";
  contents.frames = frames;
  glm::dvec3 low = all.front(), high = all.front();
  for (const glm::dvec3& point : all) low = glm::min(low, point), high = glm::max(high, point);
  contents.more.emplace_back(
      "Place", fmt::format("({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f}) mm, LPS", low.x,
                           low.y, low.z, high.x, high.y, high.z));
  return contents;
}

}  // namespace

Result<Contents> contents_of(const fs::path& path, const OnShare& on_share) {
  std::error_code error;
  if (fs::is_directory(path, error)) return contents_of_folder(path, on_share);
  if (files::split_series(path) || path.filename() == "DICOMDIR")
    return contents_of_frames(path, "DICOM", on_share);
  const auto kind = files::sniff(path);
  if (!kind) return kind.error();
  if (files::holds_sequence_motion(path)) return contents_of_sequence_motion(path, on_share);
  const std::string start = start_of(path);
  if (start.starts_with(kRecording)) return contents_of_recording(path);
  if (*kind == files::FileKind::kDicom) return contents_of_frames(path, "DICOM", on_share);
  if (*kind == files::FileKind::kImage) return contents_of_image(path, on_share);
  if (start.find(loading::kTubesTitle) != std::string::npos) return contents_of_tubes(path);
  const std::string ending = files::lowered(path.extension().string());
  if (x3d::is_x3d(path)) return contents_of_scene(path);
  if (ending == ".json" || files::trimmed(start).starts_with('{')) return contents_of_json(path);
  if (ending == ".csv" || ending == ".fcsv" || ending == ".txt" || ending == ".tsv")
    return contents_of_table(path, start);
  // Not an image: the sentence says which formats palpate reads.
  return contents_of_image(path, on_share);
}

Together together(const Grid& first, const Grid& other) {
  Together found;
  found.same_grid = same_geometry(other, first);
  if (!found.same_grid) found.difference = files::difference(other, first);
  // Points spread evenly through the first image: enough to tell no, partial and full overlap.
  constexpr int kPoints = 16;
  int inside = 0;
  for (int n = 0; n < kPoints * kPoints * kPoints; ++n) {
    const glm::dvec3 share =
        (glm::dvec3(n % kPoints, n / kPoints % kPoints, n / (kPoints * kPoints)) + 0.5) /
        double(kPoints);
    const glm::dvec3 at =
        other.index_from_lps(first.lps_from_index(share * glm::dvec3(first.size) - 0.5));
    const glm::dvec3 last = glm::dvec3(other.size) - 0.5;
    inside += glm::all(glm::greaterThanEqual(at, glm::dvec3(-0.5))) &&
              glm::all(glm::lessThanEqual(at, last));
  }
  found.overlap = double(inside) / (kPoints * kPoints * kPoints);
  return found;
}

std::string axes_letters(const Grid& grid) {
  constexpr const char* kLetters[3][2] = {{"L", "R"}, {"P", "A"}, {"S", "I"}};
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 along = grid.direction[axis];
    int most = 0;
    for (int c = 1; c < 3; ++c)
      if (std::abs(along[c]) > std::abs(along[most])) most = c;
    text += (axis ? "-" : "") + std::string(kLetters[most][along[most] < 0.0]);
  }
  return text;
}

double oblique_degrees(const Grid& grid) {
  double most = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 along = glm::abs(grid.direction[axis]);
    const double cosine = std::max({along.x, along.y, along.z});
    const double angle = std::acos(std::min(1.0, cosine));
    if (angle > kAxis) most = std::max(most, angle);
  }
  return glm::degrees(most);
}

}  // namespace palpate::app
