#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "integration/files/scene/option_ranges.h"
#include "integration/files/scene/scene_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"
#include "integration/x3d/mode_nodes.h"
#include "integration/x3d/node_names.h"
#include "integration/x3d/raw_types.h"
#include "integration/x3d/x3d_fields.h"
#include "integration/x3d/x3d_file.h"
#include "integration/x3d/xml_tree.h"
#include "module/scene/drive.h"

namespace palpate::x3d {
namespace {

namespace fs = std::filesystem;
using files::NumberRange;

constexpr uintmax_t kMostBytes = 16 << 20;  // the same limit as for scenes in JSON
constexpr size_t kMostVisits = 200'000;     // USE can multiply nodes without writing them
constexpr size_t kDeepest = 256;            // with USE and Inline
constexpr size_t kMostVolumes = 64, kMostModes = 256, kMostDocuments = 64;
constexpr double kDefaultSoftness_m = 0.01;
constexpr double kMostOpaque = 0.999;  // of a LookPoint

struct Route {
  std::string from, from_field, to, to_field;
  bool followed = false;
};

/// One file: its elements, the names in it, its ROUTEs.
struct Document {
  fs::path file;
  XmlTree tree;
  std::map<std::string, size_t> names;  ///< DEF
  std::vector<Route> routes;
  std::set<size_t> driving;  ///< sensors and interpolators that a ROUTE uses
};

struct Node {
  Document* document = nullptr;
  size_t index = 0;
  const XmlElement& element() const { return document->tree[index]; }
  const std::string& name() const { return element().name; }
  auto operator<=>(const Node&) const = default;
};

/// The place of a node: keyed transforms, the outermost first, and the fixed transform within them.
struct NodePlace {
  std::vector<KeyedPose> poses;
  glm::dmat4 still{1.0};
};

/// A field's name without the prefix or suffix for its direction.
std::string bare(std::string field) {
  if (field.starts_with("set_")) field.erase(0, 4);
  if (field.ends_with("_changed")) field.erase(field.size() - 8);
  return field;
}

bool is_sensor_or_interpolator(std::string_view name) {
  return name == "TimeSensor" || name == "PositionInterpolator" ||
         name == "OrientationInterpolator" || name == "SplinePositionInterpolator";
}

bool is_data(std::string_view name) {
  for (const char* known : {"VolumeData", "SegmentedVolumeData", "IsoSurfaceVolumeData",
                            "VectorVolume", "VectorImageVolume", "VectorElectroPotential",
                            "ScalarElectroPotential", "SampledScalarVolume"})
    if (name == known) return true;
  return false;
}

bool is_texture(std::string_view name) {
  return name == "ImageTexture3D" || name == "Image3DTexture" || name == kSequenceNode;
}

/// Nodes that draw lines along vectors.
bool is_stream(std::string_view name) {
  return name == "StreamTubes" || name == "StreamRibbons";
}

/// A loader only repeats what the file itself contains.
bool is_loader(std::string_view name) {
  return name == "NrrdImageLoader" || name == "DicomImageLoader";
}

/// A field without effect on what is felt, whatever its value.
bool is_common_field(std::string_view name) {
  for (const char* known : {"DEF", "USE", "containerField", "class", "id", "style", "bboxCenter",
                            "bboxSize", "profile", "version"})
    if (name == known) return true;
  return name.starts_with("xmlns") || name.starts_with("xsd:") || name.starts_with("xsi:");
}

glm::dmat4 scaled(glm::dvec3 scale) {
  return glm::scale(glm::dmat4(1.0), scale);
}

Result<Transform> as_transform(const glm::dmat4& m) {
  return m == glm::dmat4(1.0) ? Result<Transform>(Transform{}) : split(m);
}

class X3dSceneReader {
 public:
  explicit X3dSceneReader(bool opens_files, fs::path folder = {})
      : opens_files_(opens_files), folder_(std::move(folder)) {}

  Result<X3dScene> read(const fs::path& file, std::string_view text) {
    scene_.files.push_back(file);
    Document* document = open(file, text);
    if (!document) return *error_;
    visit({document, 0}, NodePlace{});
    if (!error_ && scene_.spec.volumes.empty())
      error_ =
          files::bad_input(file, "holds no volume that palpate can read: {}.", why_no_volume());
    if (error_) return *error_;
    sum_up();
    return std::move(scene_);
  }

 private:
  // Sentences ---------------------------------------------------------------------------------

  bool good() const { return !error_; }

  void refuse(const Node& node, const std::string& what) {
    if (error_) return;
    std::string misspelled;
    for (const Node& child : children(node))
      if (const auto meant = meant_node(child.name()); !meant.empty() && misspelled.empty())
        misspelled = fmt::format(" ({} in line {} is no node: correct its name to {})",
                                 child.name(), child.element().line, meant);
    error_ = files::bad_input(node.document->file, "can not be used at line {}, {}: {}{}.",
                              node.element().line, node.name(), what, misspelled);
  }
  void refuse(const Node& node, const std::string& field, const std::string& what) {
    refuse(node, fmt::format("{}: {}", field, what));
  }
  void refuse(const Node& node, const Error& error) {
    std::string what = error.message;
    if (what.ends_with('.')) what.pop_back();
    refuse(node, what);
  }

  /// Leaves out a node that may contain volumes, such as a choice of a Switch that is not taken.
  void leave_out_branch(const Node& node, const std::string& of) {
    branch_ = of;
    leave_out(node);
    branch_.clear();
  }

  /// Notes a node without effect, and the nodes in it.
  void leave_out(const Node& node) {
    if (!count_visit(node)) return;
    const XmlElement& e = node.element();
    if (!branch_.empty() && is_data(e.name))
      ++volumes_left_out_[fmt::format("{} in {}", e.name, branch_)];
    const bool first = used_.insert(node).second;
    const std::string* category = e.find("category");
    if (e.name == "unit" && category && *category == "length")
      return refuse(node, "lengths are metres here: write them in metres and leave the unit out");
    if (e.name != "ROUTE" && e.name != "component" && e.name != "meta")
      nodes_left_out_[e.name] += first ? 1 : 0;
    for (const size_t child : e.children)
      if (good()) leave_out({node.document, child});
  }

  bool count_visit(const Node& node) {
    if (++visits_ > kMostVisits)
      refuse(node,
             fmt::format("the scene unfolds to more than {} nodes: use fewer USE", kMostVisits));
    return good();
  }

  void sum_up() {
    for (Document& document : documents_)
      for (size_t k = 0; k < document.tree.size(); ++k) {
        const std::string& name = document.tree[k].name;
        if (is_sensor_or_interpolator(name)) {
          if (!document.driving.contains(k)) ++nodes_left_out_[name + " (drives nothing)"];
        } else if (name != "ROUTE" && !used_.contains({&document, k})) {
          // Nodes in fields where none are expected: whatever is not read is named.
          ++nodes_left_out_[name];
        }
      }

    // ROUTEs without effect.
    std::set<std::string> routes;
    for (const Document& document : documents_)
      for (const Route& r : document.routes)
        if (!r.followed)
          routes.insert(fmt::format("{}.{} to {}.{}", r.from, r.from_field, r.to, r.to_field));
    const auto say = [&](const char* what, const std::set<std::string>& names) {
      if (!names.empty())
        scene_.notes.push_back(
            fmt::format("{} without effect here: {}.", what, fmt::join(names, ", ")));
    };

    // One note for each kind of thing that was left out.
    const std::set<std::string> errors = typing_errors();
    if (!errors.empty())
      scene_.notes.push_back(
          fmt::format("Unknown nodes are left out: {}.", fmt::join(errors, ", ")));
    if (!volumes_left_out_.empty())
      scene_.notes.push_back(
          fmt::format("Volumes are left out: {}.", fmt::join(counted(volumes_left_out_), ", ")));
    say("Nodes", counted(nodes_left_out_));
    say("Fields", fields_left_out_);
    say("ROUTEs", routes);
  }

  /// "Shape (2)": each name once, with its number if there are several.
  static std::set<std::string> counted(const std::map<std::string, size_t>& names) {
    std::set<std::string> texts;
    for (const auto& [name, number] : names)
      texts.insert(number > 1 ? fmt::format("{} ({})", name, number) : name);
    return texts;
  }

  /// All nodes whose name is probably a typing error, with the name that is meant.
  std::set<std::string> typing_errors() const {
    std::set<std::string> checked, errors;
    for (const Document& document : documents_)
      for (const XmlElement& e : document.tree)
        if (checked.insert(e.name).second)
          if (const auto meant = meant_node(e.name); !meant.empty())
            errors.insert(fmt::format("{} in line {} (is {} meant?)", e.name, e.line, meant));
    return errors;
  }

  std::string why_no_volume() const {
    const std::set<std::string> errors = typing_errors();
    if (!errors.empty())
      return fmt::format("it has no known node of the name {}", fmt::join(errors, ", "));
    if (!volumes_left_out_.empty())
      return fmt::format("{} is left out; put it into a Group or a Transform",
                         fmt::join(counted(volumes_left_out_), ", "));
    return "give it a VolumeData with an ImageTexture3D, or a mode with its data";
  }

  // Documents ---------------------------------------------------------------------------------

  Document* open(const fs::path& file, std::string_view text) {
    auto tree = parse_xml(file, text);
    if (!tree) {
      if (!error_) error_ = tree.error();
      return nullptr;
    }
    documents_.push_back({file, std::move(*tree), {}, {}, {}});
    Document& document = documents_.back();
    for (size_t k = 0; k < document.tree.size() && good(); ++k) {
      const XmlElement& e = document.tree[k];
      if (const std::string* name = e.find("DEF"))
        if (!document.names.emplace(*name, k).second)
          refuse({&document, k}, "DEF",
                 fmt::format("another node is called '{}' too: choose another name", *name));
      if (e.name == "ROUTE") add_route({&document, k});
    }
    if (good()) check_routes(document);
    return good() ? &document : nullptr;
  }

  void add_route(const Node& node) {
    Route route;
    for (const auto& [field, part] : {std::pair{"fromNode", &Route::from},
                                      {"fromField", &Route::from_field},
                                      {"toNode", &Route::to},
                                      {"toField", &Route::to_field}}) {
      const std::string* value = node.element().find(field);
      if (!value) return refuse(node, field, "it is missing: name a node and a field");
      route.*part = *value;
    }
    node.document->routes.push_back(std::move(route));
  }

  /// The element that a name stands for, or null.
  const XmlElement* named(const Document& document, const std::string& name) const {
    const auto found = document.names.find(name);
    return found == document.names.end() ? nullptr : &document.tree[found->second];
  }

  /// Refuses circles of ROUTEs between the nodes through which ROUTEs are followed.
  void check_routes(Document& document) {
    const auto passes = [&](const std::string& name) {
      const XmlElement* e = named(document, name);
      return e && (is_sensor_or_interpolator(e->name) || e->name == "Transform" ||
                   e->name == kSequenceNode);
    };
    std::vector<const Route*> left;
    for (const Route& route : document.routes)
      if (passes(route.from) && passes(route.to)) left.push_back(&route);
    // A node without incoming or outgoing ROUTEs is part of no circle.
    for (bool removed = true; removed;) {
      std::set<std::string> from, to;
      for (const Route* route : left) from.insert(route->from), to.insert(route->to);
      removed = std::erase_if(left, [&](const Route* route) {
                  return !to.contains(route->from) || !from.contains(route->to);
                }) > 0;
    }
    if (left.empty()) return;
    const Route& r = *left.front();
    refuse({&document, document.names.at(r.from)},
           fmt::format("the ROUTE from {}.{} to {}.{} is part of a circle: take one of its ROUTEs "
                       "out",
                       r.from, r.from_field, r.to, r.to_field));
  }

  // Fields ------------------------------------------------------------------------------------

  /// The text of a field; marks the field as used.
  const std::string* field(const Node& node, const char* name) {
    fields_used_.insert({node, name});
    return node.element().find(name);
  }

  /// Reads the numbers of a field: as many as `out` takes.
  template <size_t N>
  bool numbers(const Node& node, const char* name, double (&out)[N],
               const NumberRange& range = files::kAnyNumber) {
    const std::string* text = field(node, name);
    if (!text || !good()) return false;
    const auto found = numbers_of(*text);
    const bool fine =
        found && found->size() == N &&
        std::all_of(found->begin(), found->end(), [&](double v) { return is_in(v, range); });
    if (!fine) {
      refuse(node, name,
             N == 1 ? fmt::format("{} is expected", files::text_of(range))
                    : fmt::format("{} numbers are expected, each {}", N, files::text_of(range)));
      return false;
    }
    std::copy(found->begin(), found->end(), out);
    return true;
  }
  bool number(const Node& node, const char* name, double& out,
              const NumberRange& range = files::kAnyNumber) {
    double v[1] = {};
    return numbers(node, name, v, range) ? (out = v[0], true) : false;
  }
  bool vector(const Node& node, const char* name, glm::dvec3& out,
              const NumberRange& range = files::kAnyNumber) {
    double v[3] = {};
    return numbers(node, name, v, range) ? (out = {v[0], v[1], v[2]}, true) : false;
  }
  bool rotation(const Node& node, const char* name, glm::dquat& out) {
    double v[4] = {};
    if (!numbers(node, name, v)) return false;
    const auto found = rotation_of(v);
    if (!found) refuse(node, name, "an axis is expected whose numbers are not all 0");
    if (found) out = *found;
    return found.has_value();
  }
  bool boolean(const Node& node, const char* name, bool& out) {
    const std::string* text = field(node, name);
    if (!text || !good()) return false;
    const auto found = boolean_of(*text);
    if (!found) refuse(node, name, "true or false is expected");
    if (found) out = *found;
    return found.has_value();
  }
  template <class T>
  void word(const Node& node, const char* name, T& out,
            const std::vector<std::pair<std::string_view, T>>& words) {
    const std::string* text = field(node, name);
    if (!text || !good()) return;
    std::vector<std::string_view> known;
    for (const auto& [word, value] : words) {
      if (word == *text) return void(out = value);
      known.push_back(word);
    }
    refuse(node, name, fmt::format("one of {} is expected", fmt::join(known, ", ")));
  }

  /// Notes the fields of a node that the reader did not use.
  void finish(const Node& node) {
    used_.insert(node);
    for (const auto& [name, value] : node.element().attributes)
      if (!is_common_field(name) && !fields_used_.contains({node, name}))
        fields_left_out_.insert(node.name() + "." + name);
  }

  /// The files of a field of URLs: the first one that exists, or all of them.
  std::vector<fs::path> urls(const Node& node, bool all) {
    const std::string* text = field(node, "url");
    std::vector<fs::path> found;
    if (!good()) return found;
    // The files of a scene within another one are beside it.
    const bool given = !folder_.empty() && node.document == &documents_.front();
    fs::path folder = given ? folder_ : node.document->file.parent_path();
    std::string missing;
    for (const std::string& url : text ? strings_of(*text) : std::vector<std::string>{}) {
      // palpate does not download.
      if (url.empty() || url.find("://") != std::string::npos || url.starts_with("urn:")) {
        if (missing.empty()) missing = url;
        continue;
      }
      const fs::path path = (folder / url).lexically_normal();
      std::error_code error;
      if (opens_files_ && !fs::exists(path, error)) {
        missing = path.string();
        if (all) break;
        continue;
      }
      found.push_back(path);
      if (!all) break;
    }
    if (found.empty() || (all && !missing.empty())) {
      std::error_code error;
      if (folder.empty()) folder = fs::current_path(error);
      refuse(node, "url",
             missing.empty()
                 ? std::string("it is missing: name a file")
                 : fmt::format("there is no file '{}': paths are relative to '{}', and nothing is "
                               "fetched from a network",
                               missing, folder.string()));
      return {};
    }
    scene_.files.insert(scene_.files.end(), found.begin(), found.end());
    return found;
  }

  // The tree ----------------------------------------------------------------------------------

  /// The node itself, or the one that it USEs. Empty after an error.
  std::optional<Node> resolve(const Node& node) {
    const std::string* name = node.element().find("USE");
    if (!name) return node;
    used_.insert(node);
    const auto found = node.document->names.find(*name);
    if (found == node.document->names.end() || found->second > node.index) {
      refuse(node, "USE", fmt::format("no node before it is called '{}': correct the name", *name));
      return std::nullopt;
    }
    const Node target{node.document, found->second};
    if (std::find(open_.begin(), open_.end(), target) != open_.end()) {
      refuse(node, "USE", fmt::format("'{}' leads back to itself: take it out", *name));
      return std::nullopt;
    }
    return target;
  }

  std::vector<Node> children(const Node& node) {
    std::vector<Node> found;
    for (const size_t child : node.element().children) found.push_back({node.document, child});
    return found;
  }

  void visit(const Node& written, const NodePlace& place) {
    if (!good() || !count_visit(written)) return;
    const auto resolved = resolve(written);
    if (!resolved) return;
    const Node node = *resolved;
    if (open_.size() >= kDeepest)
      return refuse(node, fmt::format("the scene nests more than {} deep: flatten it", kDeepest));
    open_.push_back(node);
    const std::string& name = node.name();
    if (is_group(name)) {
      finish(node);
      visit_children(node, place);
    } else if (name == "Switch" || name == "LOD") {
      choose(node, place);
    } else if (name == "Transform" || name == "CADPart") {
      visit_children(node, inside(node, place));
      finish(node);
    } else if (name == "VolumeHaptics") {
      number(node, "stiffness", scene_.spec.stiffness_n_per_m, files::kStiffnesses_n_per_m);
      number(node, "palpateDamping", scene_.spec.damping_n_s_per_m, files::kDampings_n_s_per_m);
      number(node, "palpateToolRadius", scene_.spec.tool_radius_m, files::kToolRadii_m);
      double points = scene_.spec.tool_points;
      number(node, "palpateToolPoints", points, files::kToolPoints);
      if (points != std::floor(points))
        refuse(node, "palpateToolPoints", "a whole number is expected");
      scene_.spec.tool_points = int(points);
      finish(node);
      visit_children(node, place);
    } else if (name == "Inline") {
      inlined(node, place);
    } else if (is_data(name)) {
      volume_of(node, place);
    } else if (const ModeNode* kind = mode_node(name)) {
      mode(node, *kind, place);
    } else if (name == "DeviceInfo") {
      device(node);
    } else if (name == "Shape") {
      shape(node, place);
    } else if (is_stream(name)) {
      stream(node, place);
    } else if (name != "ROUTE" && !is_sensor_or_interpolator(name)) {
      leave_out_branch(node, name);
    }
    open_.pop_back();
  }

  void visit_children(const Node& node, const NodePlace& place) {
    for (const Node& child : children(node)) {
      // What a Collision puts in the place of its children is never seen.
      const std::string* role = child.element().find("containerField");
      if (role && *role == "proxy")
        leave_out(child);
      else
        visit(child, place);
    }
  }

  /// Visits the choice of a Switch (none by default), or the first and finest level of a LOD.
  void choose(const Node& node, const NodePlace& place) {
    double choice = 0.0;
    if (node.name() == "Switch") {
      choice = -1.0;
      number(node, "whichChoice", choice);
    }
    finish(node);
    double k = 0.0;
    for (const Node& child : children(node)) {
      if (child.name().starts_with("Metadata") || child.name() == "ROUTE")
        visit(child, place);
      else if (k++ == choice)
        visit(child, place);
      else
        leave_out_branch(child, node.name() == "LOD"
                                    ? "a coarser level of LOD"
                                    : fmt::format("Switch, whose whichChoice is {}", choice));
    }
  }

  void inlined(const Node& node, const NodePlace& place) {
    bool load = true;
    boolean(node, "load", load);
    if (!good()) return;
    const std::string* text = field(node, "url");
    const bool remote =
        text && (text->find("urn:") != std::string::npos || text->find("://") != std::string::npos);
    // H3D's scenes name its own devices in this way.
    if (!load || !opens_files_ || remote) return leave_out(node);
    const std::vector<fs::path> found = urls(node, false);
    finish(node);
    if (!good()) return;
    std::error_code error;
    const fs::path file = found.front();
    for (const Node& around : open_)
      if (fs::equivalent(around.document->file, file, error))
        return refuse(node, "url",
                      fmt::format("'{}' leads back to itself: take it out", file.string()));
    if (documents_.size() >= kMostDocuments)
      return refuse(node, fmt::format("the scene is made of more than {} files: put them together",
                                      kMostDocuments));
    std::string content;
    if (const Status read = read_text(file, content); !read) {
      error_ = read.error();
      return;
    }
    if (Document* document = open(file, content)) visit({document, 0}, place);
  }

 public:
  static Status read_text(const fs::path& file, std::string& text) {
    std::error_code error;
    if (!fs::is_regular_file(file, error))
      return files::bad_input(file, "is not a file that can be read: name a scene file (X3D).");
    if (fs::file_size(file, error) > kMostBytes)
      return files::bad_input(file, "is too large to be a scene: name a scene file (X3D).");
      // Reads both plain and packed (.x3dz) files.
#ifdef _WIN32
    const gzFile opened = gzopen_w(file.c_str(), "rb");
#else
    const gzFile opened = gzopen(file.c_str(), "rb");
#endif
    const std::unique_ptr<gzFile_s, int (*)(gzFile)> stream(opened, gzclose);
    if (!stream) return files::bad_input(file, "can not be read: check its permissions.");
    text.clear();
    std::string part(1 << 16, '\0');
    int n = 0, code = Z_OK;
    do {
      n = gzread(stream.get(), part.data(), unsigned(part.size()));
      // After each read: since version 1.3.2 zlib forgets with the next one that the file was cut.
      gzerror(stream.get(), &code);
      text.append(part, 0, size_t(std::max(n, 0)));
      if (text.size() > kMostBytes)
        return files::bad_input(file, "is too large to be a scene: name a scene file (X3D).");
    } while (n > 0 && code == Z_OK);
    if (n < 0 || code != Z_OK)
      return files::bad_input(file,
                              "can not be unpacked: it is damaged or cut short; copy it again.");
    return check_encoding(file, text);
  }

  /// Refuses the encodings of X3D that are not XML.
  static Status check_encoding(const fs::path& file, std::string_view text) {
    const std::string ending = files::lowered(file.extension().string());
    const char* encoding = nullptr;
    if (text.starts_with("#X3D") || text.starts_with("#VRML") || ending == ".x3dv" ||
        ending == ".x3dvz" || ending == ".wrl" || ending == ".wrz")
      encoding = "classic VRML";
    if (text.starts_with(std::string_view("\xE0\0\0\x01", 4)) || ending == ".x3db" ||
        ending == ".x3dbz")
      encoding = "binary";
    if (files::trimmed(text).starts_with("{")) encoding = "JSON";
    if (!encoding) return Nothing{};
    return files::bad_input(file,
                            "is a scene in the {} encoding of X3D, of which palpate reads the XML "
                            "encoding only: save it as .x3d (XML), for example with view3dscene "
                            "or x3d-tidy.",
                            encoding);
  }

 private:
  void device(const Node& node) {
    finish(node);
    for (const Node& child : children(node)) {
      const auto one = resolve(child);
      if (!one) return;
      if (!one->name().ends_with("Device")) {
        leave_out(*one);
        continue;
      }
      number(*one, "forceLimit", scene_.spec.max_force_n, files::kForces_n);
      double m[16] = {};
      if (numbers(*one, "positionCalibration", m)) {
        glm::dmat4 matrix(1.0);  // written by rows
        for (int k = 0; k < 16; ++k) matrix[k % 4][k / 4] = m[k];
        const auto found = as_transform(matrix);
        if (!found) return refuse(*one, found.error());
        scene_.spec.world_from_device = *found;
      }
      finish(*one);
      for (const Node& part : children(*one)) leave_out(part);
      if (one->name() == "AnyDevice") continue;
      scene_.notes.push_back(fmt::format(
          "The scene names a {}: which device gives the force is said by `device`.", one->name()));
    }
  }

  // Transforms --------------------------------------------------------------------------------

  NodePlace inside(const Node& node, NodePlace place) {
    Transform t;
    glm::dvec3 centre(0.0);
    glm::dquat orientation(1.0, 0.0, 0.0, 0.0);
    vector(node, "translation", t.translation_m);
    vector(node, "center", centre);
    vector(node, "scale", t.scale, files::kScales);
    rotation(node, "rotation", t.rotation);
    rotation(node, "scaleOrientation", orientation);
    if (!good()) return place;

    // Where ROUTEs move it, in time.
    KeyedPose keyed{t, {}, {}, {}};
    animate(node, keyed);
    const bool scales = !keyed.scale.keys.empty();
    const bool moves = scales || !keyed.translation_m.keys.empty() || !keyed.rotation.keys.empty();
    const glm::dmat4 turned = glm::mat4_cast(orientation);
    const glm::dmat4 back = glm::translate(glm::dmat4(1.0), -centre);

    // A transform at rest joins those around it.
    if (!moves) {
      if (t == Transform{} && centre == glm::dvec3(0.0)) return place;
      place.still *= glm::translate(glm::dmat4(1.0), t.translation_m + centre) *
                     glm::mat4_cast(t.rotation) * turned * scaled(t.scale) * glm::inverse(turned) *
                     back;
      return place;
    }

    // One that moves becomes a pose with keys, between what is around it and what is in it.
    if (scales && orientation != glm::dquat(1.0, 0.0, 0.0, 0.0))
      refuse(node, "scaleOrientation",
             "a scale that a ROUTE changes can not be turned: leave it out");
    // X3D: x' = T C R SR S -SR -C x. T and C are one translation; the part to the right of R S
    // stays.
    keyed.pose.translation_m += centre;
    for (glm::dvec3& value : keyed.translation_m.values) value += centre;
    glm::dmat4 within = back;
    if (!scales) {
      keyed.pose.scale = glm::dvec3(1.0);
      within = turned * scaled(t.scale) * glm::inverse(turned) * back;
    }
    if (place.still != glm::dmat4(1.0)) {
      const auto outer = split(place.still);
      if (!outer) {
        refuse(node, outer.error());
        return place;
      }
      place.poses.push_back({*outer, {}, {}, {}});
    }
    place.poses.push_back(std::move(keyed));
    place.still = within;
    return place;
  }

  /// The values that ROUTEs bring from a TimeSensor through an interpolator to a Transform.
  void animate(const Node& node, KeyedPose& pose) {
    const std::string* name = node.element().find("DEF");
    if (!name) return;
    for (Route& route : node.document->routes) {
      if (route.to != *name) continue;
      const std::string to = bare(route.to_field);
      if (to == "translation")
        follow(node, route, "PositionInterpolator", pose.translation_m, {-1e6, 1e6});
      else if (to == "scale")
        follow(node, route, "PositionInterpolator", pose.scale, files::kScales);
      else if (to == "rotation")
        follow(node, route, "OrientationInterpolator", pose.rotation, files::kAnyNumber);
    }
  }

  /// The TimeSensor whose fraction is routed to the named node.
  Route* fraction_route(Document& document, const std::string& to, Node& sensor) {
    for (Route& route : document.routes) {
      if (route.to != to || bare(route.to_field) != "fraction") continue;
      const auto found = document.names.find(route.from);
      if (found == document.names.end() || bare(route.from_field) != "fraction") continue;
      sensor = {&document, found->second};
      if (sensor.name() == "TimeSensor") return &route;
    }
    return nullptr;
  }

  /// Reads the times of a sensor. False if it is off.
  bool sense(const Node& sensor, double& cycle_s, bool& loop) {
    cycle_s = 1.0;
    loop = false;
    bool enabled = true;
    number(sensor, "cycleInterval", cycle_s, {1e-3, 1e6});
    boolean(sensor, "loop", loop);
    boolean(sensor, "enabled", enabled);
    finish(sensor);
    sensor.document->driving.insert(sensor.index);
    return enabled && good();
  }

  template <class T>
  void follow(const Node& node, Route& route, const char* kind, KeyTrack<T>& track,
              const NumberRange& range) {
    Document& document = *node.document;
    const auto found = document.names.find(route.from);
    if (found == document.names.end() || bare(route.from_field) != "value") return;
    const Node interpolator{&document, found->second};
    const char* spline = std::is_same_v<T, glm::dvec3> ? "SplinePositionInterpolator" : kind;
    Node sensor;
    Route* fraction = (interpolator.name() == kind || interpolator.name() == spline)
                          ? fraction_route(document, route.from, sensor)
                          : nullptr;
    if (!fraction || !track.keys.empty()) return;  // the ROUTE is noted as unused at the end

    // The sensor that drives it, and its keys and values.
    KeyTrack<T> read;
    if (!sense(sensor, read.cycle_s, read.loop)) return;
    const std::string* keys = field(interpolator, "key");
    const std::string* values = field(interpolator, "keyValue");
    const auto key_numbers = numbers_of(keys ? *keys : "");
    const auto value_numbers = numbers_of(values ? *values : "");
    constexpr size_t kEach = sizeof(T) / sizeof(double);
    if (!key_numbers || !value_numbers || key_numbers->empty() ||
        value_numbers->size() != kEach * key_numbers->size())
      return refuse(interpolator,
                    fmt::format("key and keyValue have to hold plain numbers, {} values for each "
                                "key: correct them",
                                kEach));
    read.keys = *key_numbers;
    for (size_t k = 0; k < read.keys.size(); ++k) {
      const double* v = value_numbers->data() + kEach * k;
      const bool fits = std::all_of(v, v + kEach, [&](double one) { return is_in(one, range); });
      const std::optional<T> value = fits ? value_of<T>(v) : std::nullopt;
      if (!value || read.keys[k] < (k ? read.keys[k - 1] : 0.0) || read.keys[k] > 1.0)
        return refuse(interpolator,
                      fmt::format("key {} or its value can not be used: keys rise from 0 to 1, "
                                  "scales are 1e-4 to 1e4, axes have a length",
                                  k));
      read.values.push_back(*value);
    }
    if constexpr (std::is_same_v<T, glm::dvec3>)
      if (interpolator.name() == "SplinePositionInterpolator" && !bend(interpolator, range, read))
        return;
    finish(interpolator);
    // All is right: the ROUTE has its effect.
    track = std::move(read);
    route.followed = fraction->followed = true;
    document.driving.insert(interpolator.index);
  }

  /// The tangent of a spline at each value: what was given (three numbers each), else half the way
  /// between its neighbours. even_speed: tangents of the whole curve's length.
  static std::vector<glm::dvec3> tangents_of(const std::vector<glm::dvec3>& value,
                                             const std::vector<double>& given, bool closed,
                                             bool even_speed) {
    const size_t n = value.size();
    std::vector<glm::dvec3> tangent(n, glm::dvec3(0.0));
    double length = 0.0;
    for (size_t k = 0; k + 1 < n; ++k) length += glm::distance(value[k], value[k + 1]);
    for (size_t k = 0; k < n; ++k) {
      if (!given.empty()) {
        const double* v = given.data() + 3 * k;
        tangent[k] = {v[0], v[1], v[2]};
        const double speed = glm::length(tangent[k]);
        if (even_speed && speed > 0.0) tangent[k] *= length / speed;
      } else if (k > 0 && k + 1 < n) {
        tangent[k] = 0.5 * (value[k + 1] - value[k - 1]);
      } else if (closed) {
        tangent[k] = 0.5 * (value[1] - value[n - 2]);
      }
    }
    return tangent;
  }

  /// Replaces the values by a spline through them, in straight segments: X3D's cubic Hermite curve,
  /// with tangents in values per interval between keys.
  bool bend(const Node& node, const NumberRange& range, KeyTrack<glm::dvec3>& track) {
    constexpr size_t kMostKeys = 1000;
    constexpr int kPieces = 32;
    const size_t n = track.keys.size();
    bool closed = false, even_speed = false;
    boolean(node, "closed", closed);
    boolean(node, "normalizeVelocity", even_speed);
    const std::string* text = field(node, "keyVelocity");
    const auto given = numbers_of(text ? *text : "");
    if (!good()) return false;
    if (!given || (!given->empty() && given->size() != 3 * n) || n > kMostKeys) {
      refuse(node, fmt::format("keyVelocity has to hold plain numbers, three for each key or none, "
                               "and a spline at most {} keys: correct it",
                               kMostKeys));
      return false;
    }
    if (n < 2) return true;
    const std::vector<double>& key = track.keys;
    const std::vector<glm::dvec3>& value = track.values;
    closed = closed && value.front() == value.back();
    const std::vector<glm::dvec3> tangent = tangents_of(value, *given, closed, even_speed);
    // Keys at uneven distances: the share of the interval before a key applies to the tangent at
    // which the key is left, the share after it to the tangent at which it is reached.
    const auto share = [&](size_t k, bool before) {
      const bool end = k == 0 || k + 1 == n;
      if (end && !closed) return 1.0;
      const double back = end ? key[n - 1] - key[n - 2] : key[k] - key[k - 1];
      const double on = end ? key[1] - key[0] : key[k + 1] - key[k];
      return back + on > 0.0 ? 2.0 * (before ? back : on) / (back + on) : 1.0;
    };
    KeyTrack<glm::dvec3> bent{{}, {}, track.cycle_s, track.loop};
    for (size_t k = 0; k + 1 < n; ++k) {
      const glm::dvec3 leaving = share(k, true) * tangent[k];
      const glm::dvec3 arriving = share(k + 1, false) * tangent[k + 1];
      for (int piece = 0; piece < kPieces; ++piece) {
        const double s = double(piece) / kPieces, s2 = s * s, s3 = s2 * s;
        bent.keys.push_back(key[k] + s * (key[k + 1] - key[k]));
        bent.values.push_back((2.0 * s3 - 3.0 * s2 + 1.0) * value[k] +
                              (3.0 * s2 - 2.0 * s3) * value[k + 1] + (s3 - 2.0 * s2 + s) * leaving +
                              (s3 - s2) * arriving);
      }
    }
    bent.keys.push_back(key.back());
    bent.values.push_back(value.back());
    for (const glm::dvec3& v : bent.values)
      if (!is_in(v.x, range) || !is_in(v.y, range) || !is_in(v.z, range)) {
        refuse(node, "its curve leaves what can be moved or scaled to: give smaller velocities");
        return false;
      }
    track = std::move(bent);
    return true;
  }

  template <class T>
  static std::optional<T> value_of(const double* v) {
    if constexpr (std::is_same_v<T, glm::dquat>)
      return rotation_of(v);
    else
      return T(v[0], v[1], v[2]);
  }

  /// Sets the transform of a volume, and its motion.
  bool put(const Node& node, const NodePlace& place, VolumeSpec& volume) {
    const auto still = as_transform(place.still);
    if (!still) return refuse(node, still.error()), false;
    volume.transform = *still;
    if (!place.poses.empty() && !turns(place, volume)) {
      volume.drive.kind = DriveSpec::Kind::kKeys;
      volume.drive.poses = place.poses;
    }
    volume.path = usual_path(volume.drive.kind);
    if (const Status fine = check(volume.drive, volume.transform); !fine)
      return refuse(node, fine.error()), false;
    return true;
  }

  /// A rotation at constant speed, all the way round and repeated, becomes a drive that rotates.
  static bool turns(const NodePlace& place, VolumeSpec& volume) {
    size_t moving = 0, which = 0;
    for (size_t k = 0; k < place.poses.size(); ++k) {
      const KeyedPose& pose = place.poses[k];
      if (!pose.translation_m.keys.empty() || !pose.scale.keys.empty()) return false;
      if (!pose.rotation.keys.empty()) ++moving, which = k;
    }

    // Only one rotation moves, repeatedly and over the whole cycle.
    if (moving != 1) return false;
    const KeyedPose& turning = place.poses[which];
    const KeyTrack<glm::dquat>& track = turning.rotation;
    if (!track.loop || track.keys.size() < 4 || track.keys.front() != 0.0 ||
        track.keys.back() != 1.0)
      return false;
    const glm::dquat first = track.values.front();

    // All its keys lie on one turn at constant speed.
    glm::dquat step = track.values[1] * glm::conjugate(first);
    if (step.w < 0.0) step = -step;
    glm::dvec3 axis(step.x, step.y, step.z);
    if (!(glm::length(axis) > 1e-6)) return false;
    axis = glm::normalize(axis);
    // Tables of rotations are written with few digits.
    constexpr double kSameRotation = 1e-4;
    for (size_t k = 0; k < track.keys.size(); ++k) {
      if (k > 0 && track.keys[k] - track.keys[k - 1] > 0.49) return false;
      const glm::dquat at = glm::angleAxis(glm::two_pi<double>() * track.keys[k], axis) * first;
      if (1.0 - std::abs(glm::dot(at, track.values[k])) > kSameRotation * kSameRotation)
        return false;
    }

    // What is around and within it at the start; a rotation needs the same scale on all axes.
    glm::dmat4 outer(1.0), within(1.0);
    for (size_t k = 0; k < place.poses.size(); ++k)
      (k < which ? outer : within) *=
          matrix(k == which ? Transform{turning.pose.translation_m, first, turning.pose.scale}
                            : place.poses[k].pose);
    const auto before = as_transform(outer);
    const auto start = as_transform(outer * within * matrix(volume.transform));
    if (!before || !start) return false;
    const glm::dvec3 s = before->scale;
    if (std::abs(s.x - s.y) + std::abs(s.x - s.z) > 1e-9 * s.x) return false;
    volume.transform = *start;

    // The drive in the coordinates of the scene.
    DriveSpec& drive = volume.drive;
    drive.kind = DriveSpec::Kind::kTurn;
    drive.axis = before->rotation * axis;
    drive.rate_hz = 1.0 / track.cycle_s;
    drive.centre_m = before->world_from_volume(turning.pose.translation_m);
    // Of two equivalent descriptions take the one whose axis points to the positive side.
    const glm::dvec3 size = glm::abs(drive.axis);
    const int longest = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    if (drive.axis[longest] < 0.0) {
      drive.axis = -drive.axis;
      drive.rate_hz = -drive.rate_hz;
    }
    return true;
  }

  // Volumes -----------------------------------------------------------------------------------

  /// The name from metadata, DEF or the kind, made unique among `taken`.
  template <class Specs>
  std::string name_of(const Node& node, std::string usual, const Specs& taken) {
    if (const std::string* def = node.element().find("DEF")) usual = *def;
    for (const Node& child : children(node)) {
      const std::string* name = child.element().find("name");
      const std::string* value = child.element().find("value");
      if (child.name() != "MetadataString" || !name || *name != kNameMetadata || !value) continue;
      const std::vector<std::string> strings = strings_of(*value);
      if (!strings.empty() && !strings.front().empty()) usual = strings.front();
    }
    if (usual.empty()) usual = node.name();
    const auto is_taken = [&](const std::string& name) {
      return std::any_of(taken.begin(), taken.end(),
                         [&](const auto& one) { return one.name == name; });
    };
    std::string name = usual;
    for (int n = 2; is_taken(name); ++n) name = fmt::format("{} {}", usual, n);
    return name;
  }

  /// Whether this is the metadata that name_of() reads.
  bool is_name(const Node& node) {
    const std::string* name = node.element().find("name");
    const bool is = node.name() == "MetadataString" && name && *name == kNameMetadata;
    if (is) used_.insert(node);
    return is;
  }

  /// Returns the volume of a data node at a place; creates it at the first call. -1 after an error.
  int volume_of(const Node& node, const NodePlace& place) {
    if (!good()) return -1;
    if (node.name() == "SampledScalarVolume") return sampled(node, place);
    VolumeSpec volume;

    // The same data at the same place are one volume.
    if (!put(node, place, volume)) return -1;
    for (size_t v = 0; v < scene_.spec.volumes.size(); ++v) {
      const VolumeSpec& other = scene_.spec.volumes[v];
      if (sources_[v] == node && other.transform == volume.transform &&
          other.drive.poses == volume.drive.poses && other.drive.kind == volume.drive.kind &&
          other.drive.axis == volume.drive.axis && other.drive.rate_hz == volume.drive.rate_hz &&
          other.drive.centre_m == volume.drive.centre_m)
        return int(v);
    }
    if (scene_.spec.volumes.size() >= kMostVolumes)
      return refuse(node, fmt::format("the scene has more than {} volumes: leave some out",
                                      kMostVolumes)),
             -1;

    // Its data, by the kind of node.
    if (node.name().ends_with("ElectroPotential"))
      charges(node, volume);
    else if (node.name().ends_with("VolumeData"))
      volume_data(node, volume);
    else
      vectors(node, volume);
    finish(node);
    if (!good()) return -1;

    // Its name.
    std::string usual = volume.files.empty() ? "charges" : volume.files.front().stem().string();
    volume.name = name_of(node, std::move(usual), scene_.spec.volumes);
    scene_.spec.volumes.push_back(std::move(volume));
    sources_.push_back(node);
    return int(scene_.spec.volumes.size()) - 1;
  }

  /// A volume that is sampled from another one: the formula of the other one is used directly.
  int sampled(const Node& node, const NodePlace& place) {
    int found = -1;
    finish(node);
    for (const Node& child : children(node)) {
      const auto one = resolve(child);
      if (!one) return -1;
      if (found < 0 && is_data(one->name()) && one->name() != "SampledScalarVolume")
        found = volume_of(*one, place);
      else
        leave_out(*one);
    }
    if (found < 0 && good()) refuse(node, "it has no data: put a ScalarElectroPotential into it");
    return found;
  }

  void charges(const Node& node, VolumeSpec& volume) {
    volume.source = "charges";

    // Three lists of numbers that have to fit together.
    const std::string* points = field(node, "point");
    const std::string* potentials = field(node, "potential");
    const std::string* soft = field(node, "palpateSoftness");
    const auto point = numbers_of(points ? *points : "");
    const auto potential = numbers_of(potentials ? *potentials : "");
    auto softness = numbers_of(soft ? *soft : "");
    if (!point || !potential || potential->empty() || point->size() != 3 * potential->size())
      return refuse(node,
                    "point and potential have to hold plain numbers, a point for each "
                    "potential: correct them");
    if (softness && softness->empty()) softness = {{kDefaultSoftness_m}};
    if (!softness || (softness->size() != 1 && softness->size() != potential->size()) ||
        !std::all_of(softness->begin(), softness->end(),
                     [](double s) { return is_in(s, files::kSoftnesses_m); }))
      return refuse(node, "palpateSoftness",
                    fmt::format("{} is expected, one for all charges or one for each",
                                files::text_of(files::kSoftnesses_m)));
    for (size_t k = 0; k < potential->size(); ++k) {
      const double* at = point->data() + 3 * k;
      volume.charges.push_back(
          {{at[0], at[1], at[2]}, (*potential)[k], (*softness)[softness->size() == 1 ? 0 : k]});
    }
    glm::dvec3 size;
    if (vector(node, "size", size, files::kEdges_m)) volume.box_m = size;
    for (const Node& child : children(node))
      if (!is_name(child)) leave_out(child);
  }

  void volume_data(const Node& node, VolumeSpec& volume) {
    glm::dvec3 box(1.0);
    volume.box_assumed = !vector(node, "dimensions", box, files::kEdges_m);
    volume.box_m = box;
    boolean(node, "visible", volume.appearance.shown);
    for (const Node& child : children(node)) {
      if (!good()) return;
      const auto one = resolve(child);
      if (!one) return;
      const std::string* role = child.element().find("containerField");
      const bool labels = role && *role == "segmentIdentifiers";
      if (node.name() == "VolumeData" && one->name().ends_with("VolumeStyle")) {
        if (!volume.appearance.points.empty() || !style(*one, volume.appearance)) leave_out(*one);
        continue;
      }
      if (!is_texture(one->name()) || (role && *role != "voxels" && !labels)) {
        if (!is_name(child)) leave_out(*one);
      } else if (labels && volume.segments.files.empty()) {
        volume.segments.files = urls(*one, one->name() == kSequenceNode);
        finish(*one);
      } else if (!labels && volume.files.empty()) {
        texture(*one, volume);
      } else {
        leave_out(*one);
      }
    }
    if (volume.files.empty() && good()) refuse(node, why_no_voxels(node));
  }

  std::string why_no_voxels(const Node& node) {
    for (const Node& child : children(node)) {
      if (child.name() == "PixelTexture3D")
        return "the voxels of its PixelTexture3D stand in the scene itself, and palpate reads them "
               "from files only: write them to a file (NRRD, MetaImage, NIfTI or DICOM) and name "
               "it "
               "in an ImageTexture3D";
      if (child.name() == "ComposedTexture3D")
        return "the voxels of its ComposedTexture3D are single pictures, which palpate does not "
               "read: write them to a file (NRRD, MetaImage, NIfTI or DICOM) and name it in an "
               "ImageTexture3D";
    }
    return "it has no voxels: put an ImageTexture3D into it";
  }

  /// Reads the files of a texture; for palpate's own sequence node also what drives it.
  void texture(const Node& node, VolumeSpec& volume) {
    const bool sequence = node.name() == kSequenceNode;
    volume.files = urls(node, sequence);
    if (!good()) return;
    const std::string* name = node.element().find("DEF");
    Node sensor;
    if (sequence && name)
      if (Route* route = fraction_route(*node.document, *name, sensor)) {
        if (sense(sensor, volume.cycle_s, volume.cyclic))
          route->followed = true;
        else
          volume.cycle_s = 0.0;
      }
    for (const Node& child : children(node)) {
      const auto loader = resolve(child);
      if (!loader) return;
      if (loader->name() == "RawImageLoader")
        raw_loader(*loader, volume, sequence);
      else if (is_loader(loader->name()))
        used_.insert(*loader);
      else
        leave_out(*loader);
    }
    finish(node);
  }

  /// Reads the loader of a volume's texture, or of the volume itself.
  void raw_loader(const Node& node, VolumeSpec& volume, bool of_sequence) {
    if (of_sequence)
      return refuse(node,
                    "samples without a header are one volume here, none of a sequence: write a "
                    ".nhdr or .mhd beside them and name that");
    volume.raw = raw_samples(node, !volume.box_m);
  }

  /// Reads the description of a file without a header from H3D's loader. Empty after an error.
  std::optional<RawSamples> raw_samples(const Node& node, bool needs_spacing) {
    RawSamples raw;

    // Size.
    const char* const edges[] = {"width", "height", "depth"};
    for (int k = 0; k < 3; ++k) {
      double samples = 1.0;
      number(node, edges[k], samples, files::kRawSizes);
      if (samples != std::floor(samples)) refuse(node, edges[k], "a whole number is expected");
      if (good()) raw.size[k] = int(samples);
    }
    // H3D's default if nothing is said is colours of 24 bits, which are no data.
    raw.components = 3;
    word(node, "pixelType", raw.components, {{"LUMINANCE", 1}, {"VEC3", 3}, {"RGB", 3}});
    std::string kind = "UNSIGNED";
    word<std::string>(node, "pixelComponentType", kind,
                      {{"UNSIGNED", "UNSIGNED"}, {"SIGNED", "SIGNED"}, {"RATIONAL", "RATIONAL"}});
    double bits = 24.0;
    number(node, "bitsPerPixel", bits);
    const auto type = raw_type(kind, bits / raw.components);
    if (!type && good())
      refuse(node, "bitsPerPixel",
             fmt::format("a number of such a pixel has 8, 16, 32 or 64 bits, a RATIONAL one 32 or "
                         "64, and a pixel {} of them",
                         raw.components));

    // Spacing.
    glm::dvec3 spacing_m(0.0);
    vector(node, "pixelSize", spacing_m, files::kNotNegative);
    finish(node);
    for (const Node& child : children(node)) leave_out(child);
    const bool has_spacing = glm::all(glm::greaterThan(spacing_m, glm::dvec3(0.0)));
    if (needs_spacing && !has_spacing)
      refuse(node, "pixelSize",
             "it is missing: without a header only it says how large the volume is, in metres");
    if (!good()) return std::nullopt;
    raw.type = *type;
    if (has_spacing) raw.spacing_m = spacing_m;
    return raw;
  }

  static std::optional<SampleType> raw_type(const std::string& kind, double bits) {
    for (const auto& [name, number, type] : kRawTypes)
      if (name == kind && number == bits) return type;
    return std::nullopt;
  }

  void vectors(const Node& node, VolumeSpec& volume) {
    // A loader can stand before or after the sequence that it conflicts with.
    bool has_sequence = false;
    for (const Node& child : children(node)) {
      const auto one = resolve(child);
      if (!one) return;
      has_sequence |= one->name() == kSequenceNode;
    }
    for (const Node& child : children(node)) {
      if (!good()) return;
      const auto one = resolve(child);
      if (!one) return;
      if (is_texture(one->name()) && volume.files.empty())
        texture(*one, volume);
      else if (one->name() == "RawImageLoader")
        raw_loader(*one, volume, has_sequence);
      else if (is_loader(one->name()))
        used_.insert(*one);
      else if (!is_name(child))
        leave_out(*one);
    }
    if (volume.files.empty() && good()) volume.files = urls(node, false);
  }

  // What is seen ------------------------------------------------------------------------------

  /// Reads colours and opacities from a style of volume rendering. False if nothing in it has an
  /// effect here.
  bool style(const Node& node, AppearanceSpec& appearance) {
    bool enabled = true;
    boolean(node, "enabled", enabled);
    if (!good() || !enabled || !count_visit(node)) return false;
    const bool composed = node.name() == "ComposedVolumeStyle";
    if (!composed && node.name() != "OpacityMapVolumeStyle") return false;
    std::vector<Node> others;
    bool found = false;
    for (const Node& child : children(node)) {
      const auto one = resolve(child);
      if (!one) return false;
      // No deeper nesting: a composed style contains only styles that are not composed.
      const bool takes = composed
                             ? one->name() == "OpacityMapVolumeStyle" && style(*one, appearance)
                             : one->name() == "PixelTexture" && transfer_texture(*one, appearance);
      if (takes && !found)
        found = true;
      else
        others.push_back(*one);
    }
    if (!found || !good()) return false;
    finish(node);
    for (const Node& other : others) leave_out(other);
    return good();
  }

  /// Reads one row of texels: the appearance of the values from the lowest to the highest.
  bool transfer_texture(const Node& node, AppearanceSpec& appearance) {
    if (!appearance.points.empty()) return false;
    const std::string* text = field(node, "image");
    const auto image = image_of(text ? *text : "");
    if (!image) {
      refuse(node, "image",
             "width, height, 1 to 4 components and as many texels are expected: correct them");
      return false;
    }
    // A second dimension would stand for something other than values.
    if (image->height != 1) return false;
    for (int k = 0; k < image->width; ++k) {
      const auto byte = [&](int from_last) {
        return double(image->texels[size_t(k)] >> (8 * from_last) & 0xff) / 255.0;
      };
      const int n = image->components;
      const bool has_alpha = n == 2 || n == 4;
      LookPoint point;
      point.value = (k + 0.5) / image->width;
      point.colour =
          n >= 3 ? glm::dvec3(byte(n - 1), byte(n - 2), byte(n - 3)) : glm::dvec3(byte(n - 1));
      point.opacity = std::min(has_alpha ? byte(0) : 1.0, kMostOpaque);
      appearance.points.push_back(point);
    }
    appearance.points_of_range = true;
    finish(node);
    for (const Node& child : children(node)) leave_out(child);
    return good();
  }

  /// Of shapes only those along vectors are drawn.
  void shape(const Node& node, const NodePlace& place) {
    const std::vector<Node> parts = children(node);
    const auto streams = [](const Node& part) { return is_stream(part.name()); };
    if (std::none_of(parts.begin(), parts.end(), streams)) return leave_out(node);
    finish(node);
    for (const Node& part : parts) {
      if (!good()) return;
      if (streams(part))
        visit(part, place);
      else
        leave_out(part);
    }
  }

  /// Tubes through the data, at places that palpate chooses.
  void stream(const Node& node, const NodePlace& place) {
    int found = -1;
    for (const Node& child : children(node)) {
      if (!good()) return;
      const auto one = resolve(child);
      if (!one) return;
      const std::string* role = child.element().find("containerField");
      const bool is_way = !role || *role == "vectorVolume";
      if (found < 0 && is_way && is_data(one->name()))
        found = volume_of(*one, place);
      else
        leave_out(child);
    }
    if (!good()) return;
    if (found < 0) return leave_out(node);
    finish(node);
    scene_.spec.volumes[size_t(found)].appearance.tubes = true;
  }

  // Modes -------------------------------------------------------------------------------------

  void mode(const Node& node, const ModeNode& kind, const NodePlace& place) {
    const auto same = [&](const Node& other) { return other == node; };
    if (std::any_of(modes_.begin(), modes_.end(), same))
      return void(++nodes_left_out_[fmt::format("{} (used again)", node.name())]);
    if (scene_.spec.modes.size() >= kMostModes)
      return refuse(node,
                    fmt::format("the scene has more than {} modes: leave some out", kMostModes));
    ModeSpec m;
    m.kind = kind.kind;

    // Its children: transfer functions, and the volume that it reads.
    bool has_strength = false;
    for (const Node& child : children(node)) {
      if (!good()) return;
      const auto one = resolve(child);
      if (!one) return;
      const std::string* role = child.element().find("containerField");
      if (one->name() == "PiecewiseFunction" || one->name() == "WindowFunction") {
        const bool friction = role && *role == "friction";
        if (friction && !files::mode_key_applies(m.kind, "friction")) {
          fields_left_out_.insert(node.name() + ".friction");
          continue;
        }
        has_strength = has_strength || !friction;
        transfer(*one, friction ? m.friction : m.strength,
                 friction ? files::kFrictions : files::kStrengths_n);
      } else if (is_data(one->name()) && m.volume.empty()) {
        const int v = volume_of(*one, place);
        if (v < 0) return;
        m.volume = scene_.spec.volumes[size_t(v)].name;
        // In VHTK the vector volume of a potential is its gradient.
        if (scene_.spec.volumes[size_t(v)].source == "charges")
          m.vector = VectorProperty::kGradient;
      } else if (!is_name(child)) {
        leave_out(*one);
      }
    }
    if (!good()) return;
    if (m.volume.empty())
      return refuse(node, "it has no data: put a volume into it, or USE one that stands before it");

    // Its fields; those of X3D that this kind has.
    boolean(node, "active", m.on);
    word(node, "palpateScalar", m.scalar, files::SceneWords::kScalars);
    word(node, "palpateVector", m.vector, files::SceneWords::kVectors);
    if (const std::string* segment = field(node, "palpateSegment")) m.segment = *segment;
    const auto applies = [&](const char* key) { return files::mode_key_applies(m.kind, key); };
    if (applies("two_sided")) boolean(node, "twoSided", m.two_sided);
    if (applies("leaving")) boolean(node, "leaving", m.leaving);
    if (applies("gain")) number(node, "gain", m.gain);
    if (applies("point_m")) vector(node, "point", m.point_m);
    if (applies("range_m")) number(node, "range", m.range_m, files::kRanges_m);
    finish(node);

    // A mode that nobody would feel is an error of the scene.
    const bool force = m.kind == "gradient-force" || m.kind == "vector-force";
    if (good() && !force && !(m.strength.highest() > 0.0))
      return refuse(node, has_strength
                              ? "nothing would be felt: give a strength in N that is above 0 "
                                "somewhere"
                              : "it has no strength: put a PiecewiseFunction into it");
    m.name = name_of(node, m.kind, scene_.spec.modes);
    scene_.spec.modes.push_back(std::move(m));
    modes_.push_back(node);
  }

  void transfer(const Node& node, TransferFunction& out, const NumberRange& range) {
    Result<TransferFunction> made = TransferFunction();
    if (node.name() == "WindowFunction") {
      double level = 0.0, width = 1.0;
      number(node, "level", level);
      number(node, "width", width, files::kNotNegative);
      if (good()) made = TransferFunction::window(level, width, 1.0);
    } else {
      bool continuous = true;
      boolean(node, "continuous", continuous);
      const std::string* text = field(node, "segments");
      const auto found = numbers_of(text ? *text : "");
      if (!found || found->empty() || found->size() % 2 != 0)
        return refuse(node, "segments", "pairs of numbers are expected: in out in out ...");
      std::vector<double> in, outs;
      for (size_t k = 0; k < found->size(); k += 2) {
        in.push_back((*found)[k]);
        outs.push_back((*found)[k + 1]);
        if (!is_in(outs.back(), range))
          return refuse(node, "segments",
                        fmt::format("{} is expected as each output", files::text_of(range)));
      }
      // A single value is constant, as in other scenes.
      made = continuous ? TransferFunction::linear(std::move(in), std::move(outs))
                        : TransferFunction::stepped(std::move(in), std::move(outs));
    }
    finish(node);
    if (!good()) return;
    if (!made) return refuse(node, made.error());
    out = *made;
  }

  const bool opens_files_;
  const fs::path folder_;
  std::deque<Document> documents_;
  std::optional<Error> error_;
  X3dScene scene_;
  std::vector<Node> sources_, modes_;  ///< of the scene's volumes and modes
  std::vector<Node> open_;             ///< the node that is being visited, and its ancestors
  size_t visits_ = 0;
  std::set<Node> used_;  ///< read, or noted as left out
  std::set<std::pair<Node, std::string>> fields_used_;
  std::map<std::string, size_t> nodes_left_out_, volumes_left_out_;  ///< with their number
  std::string branch_;  ///< what contains the nodes that are being left out
  std::set<std::string> fields_left_out_;
};

}  // namespace

Result<X3dScene> parse_x3d(const fs::path& file, std::string_view text) {
  return X3dSceneReader(false).read(file, text);
}

Result<X3dScene> read_x3d(const fs::path& file, const fs::path& folder) {
  std::string text;
  if (const Status read = X3dSceneReader::read_text(file, text); !read) return read.error();
  return X3dSceneReader(true, folder).read(file, text);
}

bool is_x3d(const fs::path& file) {
  const std::string ending = files::lowered(file.extension().string());
  for (const char* known : {".x3d", ".x3dz", ".x3dv", ".x3dvz", ".x3db", ".x3dbz", ".wrl", ".wrz"})
    if (ending == known) return true;
  return false;
}

}  // namespace palpate::x3d
