#include "evaluation/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include "cameras/calibration/files.h"
#include "evaluation/picture.h"
#include "evaluation/report_page.h"
#include "evaluation/svg_plot.h"
#include "synth/dataset/image.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using nlohmann::ordered_json;

constexpr int kThumbnailPx = 320;

/// JSON that may stand in a script element: no "<" that could end it.
std::string scriptJson(const ordered_json& json) {
  std::string out;
  for (const char c : json.dump(-1, ' ', true, ordered_json::error_handler_t::replace)) {
    out += c == '<' ? std::string("\\u003c") : std::string(1, c);
  }
  return out;
}

/// A relative path as a URL: bytes other than letters, digits and "-._~/" as %XX.
std::string urlOf(const std::string& path) {
  std::string out;
  for (const char c : path) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("-._~/").find(c) != std::string_view::npos;
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

/// Keeps the points that are needed for the drawn curve to stay within 0.05 px (Douglas and
/// Peucker).
void keepNeeded(const std::vector<Vector2d>& points, size_t from, size_t to, std::string& out) {
  const Vector2d chord = points[to] - points[from];
  double farthest = 0.05;
  size_t split = to;
  for (size_t i = from + 1; i < to; ++i) {
    const Vector2d offset = points[i] - points[from];
    const double norm2 = chord.squaredNorm();
    const double t = norm2 > 0 ? std::clamp(offset.dot(chord) / norm2, 0.0, 1.0) : 0;
    if (const double distance = (offset - t * chord).norm(); distance > farthest) {
      farthest = distance;
      split = i;
    }
  }
  if (split == to) {
    out += fmt::format(" {:.2f},{:.2f}", points[to].x(), points[to].y());
    return;
  }
  keepNeeded(points, from, split, out);
  keepNeeded(points, split, to, out);
}

std::string svgPoints(const std::vector<Vector2d>& points) {
  std::string out = fmt::format("{:.2f},{:.2f}", points.front().x(), points.front().y());
  keepNeeded(points, 0, points.size() - 1, out);
  return out;
}

/// Angle to the optical axis of the ray through the middle of a curve, degrees; nothing where there
/// is no ray (a detection may reach out of the camera's domain).
std::string fieldAngleText(const Camera& camera, const std::vector<Vector2d>& points) {
  const auto ray = camera.unproject(equalArcPoints(points, 3)[1]);
  return ray ? fmt::format("{:.1f}", fieldAngle(*ray) * 180 / M_PI) : "";
}

ordered_json frameJson(size_t index, const FrameEvaluation& frame, const Camera& camera) {
  const FrameOutcome& outcome = frame.outcome;
  ordered_json labels = ordered_json::array();
  for (size_t i = 0; i < frame.labels.lines.size(); ++i) {
    const LabelLine& line = frame.labels.lines[i];
    unsigned found = 0;  // bit r: at the r-th rho
    for (size_t r = 0; r < outcome.labels.size(); ++r) {
      found |= outcome.labels[r][i].found ? 1U << r : 0;
    }
    labels.push_back(
        {{"id", line.id},
         {"kind", toString(line.kind)},
         {"stratum", toString(outcome.strata[i])},
         {"length", fmt::format("{:.1f}", line.length_px)},
         {"angle", fmt::format("{:.1f}", line.angle_rad * 180 / M_PI)},
         {"contrast", fmt::format("{:.0f}", line.contrast)},
         {"field", fieldAngleText(camera, line.points)},
         {"ends", fmt::format("{}, {}", toString(line.ends[0]), toString(line.ends[1]))},
         {"found", found},
         {"points", svgPoints(line.points)}});
  }
  ordered_json detections = ordered_json::array();
  for (size_t i = 0; i < frame.detections.lines.size(); ++i) {
    const std::vector<Vector2d>& points = frame.detections.lines[i].points;
    unsigned right = 0, merged = 0;
    ordered_json coverage = ordered_json::array();
    for (size_t r = 0; r < outcome.detections.size(); ++r) {
      const DetectionOutcome& at_rho = outcome.detections[r][i];
      right |= at_rho.right ? 1U << r : 0;
      merged |= at_rho.merged ? 1U << r : 0;
      coverage.push_back(fmt::format("{:.0f}", 100 * at_rho.coverage));
    }
    ordered_json j{{"index", i},
                   {"right", right},
                   {"merged", merged},
                   {"coverage", std::move(coverage)},
                   {"length", fmt::format("{:.1f}", curveLength(points))},
                   {"field", fieldAngleText(camera, points)},
                   {"points", svgPoints(points)}};
    if (frame.detections.lines[i].score) {
      j["score"] = fmt::format("{:.1f}", *frame.detections.lines[i].score);
    }
    detections.push_back(std::move(j));
  }
  return {{"index", index},
          {"width", frame.labels.width},
          {"height", frame.labels.height},
          {"labels", std::move(labels)},
          {"detections", std::move(detections)}};
}

/// One frame, ready to be written.
struct FramePage {
  std::string image;   ///< Relative to the data folder.
  std::string camera;  ///< Name.
  size_t labels = 0;
  Ratio found;  ///< Headline, at the largest rho.
  std::string script, thumbnail_png;
};

std::string cell(const Ratio& ratio) {
  std::string out = fmt::format("<td>{}/{}", ratio.counted, ratio.total);
  if (ratio.total > 0) {
    out +=
        fmt::format("<small>{:.1f} %</small>", 100 * double(ratio.counted) / double(ratio.total));
  }
  return out + "</td>";
}

std::string summaryHtml(const Summary& summary, bool has_detections) {
  const EvaluationOptions& options = summary.options;
  const size_t rhos = options.rho_px.size();
  std::string out = "<div class=\"scroll\"><table><thead>";
  if (has_detections) {
    out += fmt::format(
        "<tr><th></th><th></th><th></th><th class=\"group\" colspan=\"{0}\">headline labels found "
        "/ "
        "labels at &rho;</th><th></th><th class=\"group\" colspan=\"{0}\">detections &ge; "
        "{1:g}&deg; "
        "right / detections at &rho;</th></tr>",
        rhos,
        options.headline_angle_rad * 180 / M_PI);
  }
  out += "<tr><th>camera</th><th>frames</th><th>labels</th>";
  if (has_detections) {
    std::string columns;
    for (const double rho : options.rho_px) {
      columns += fmt::format("<th>{:g} px</th>", rho);
    }
    out += columns + "<th>detections</th>" + columns;
  }
  out += "</tr></thead><tbody>";
  const auto row = [&](const GroupSummary& group, std::string_view cls) {
    out += fmt::format("<tr{}><td>{}</td><td>{}</td><td>{}</td>",
                       cls,
                       escapedHtml(group.name),
                       group.frames,
                       group.labels);
    if (has_detections) {
      for (const auto& at_rho : group.at_rho) {
        out += cell(at_rho.found[size_t(Stratum::kHeadline)]);
      }
      out += fmt::format("<td>{}</td>", group.detections);
      for (const auto& at_rho : group.at_rho) {
        out += cell(at_rho.right_long);
      }
    }
    out += "</tr>";
  };
  for (const GroupSummary& group : summary.cameras) {
    row(group, "");
  }
  row(summary.all, " class=\"all\"");
  out += "</tbody></table></div>\n";
  if (has_detections) {
    out += fmt::format(
        "<p>Headline: contrast &ge; {:g} grey levels, length &ge; {:g}&deg; and {:g} px, no other "
        "label "
        "within {:g} px.</p>\n",
        options.headline_contrast,
        options.headline_angle_rad * 180 / M_PI,
        options.headline_length_px,
        options.crowded_px);
  }
  return out;
}

/// What the dataset is like: (name, value) in the order they are shown.
std::vector<std::pair<std::string, std::string>> rows(const LabelStatistics& s) {
  std::vector<std::pair<std::string, std::string>> rows{{"frames", fmt::format("{}", s.frames)},
                                                        {"labels", fmt::format("{}", s.lines)},
                                                        {"labels a frame, median (least to most)",
                                                         fmt::format("{:g} ({} to {})",
                                                                     s.median_lines_per_frame,
                                                                     s.min_lines_per_frame,
                                                                     s.max_lines_per_frame)}};
  const auto share = [&](const char* name, double value) {
    rows.emplace_back(name, fmt::format("{:.1f} %", 100 * value));
  };
  share("labels with a neighbour nearer than 10 px", s.crowdedShare());
  share("the same, counting near their ends too", s.touchingShare());
  share("ends at an occluder, the border or the rim", s.cutEndShare());
  rows.emplace_back("contrast, median (quartiles)",
                    fmt::format("{:.0f} ({:.0f}, {:.0f})",
                                s.median_contrast,
                                s.quarter_contrast,
                                s.three_quarter_contrast));
  rows.emplace_back(
      "length, median",
      fmt::format("{:.0f} px, {:.1f} deg", s.median_length_px, s.median_angle_rad * 180 / M_PI));
  std::string kinds;
  for (size_t k = 0; k < s.kinds.size(); ++k) {
    if (s.kinds[k] > 0) {
      kinds += fmt::format("{}{} {}", kinds.empty() ? "" : ", ", toString(LineKind(k)), s.kinds[k]);
    }
  }
  rows.emplace_back("kinds", kinds.empty() ? "none" : kinds);
  return rows;
}

std::string statisticsHtml(const LabelStatistics& statistics) {
  std::string out = "<dl>";
  for (const auto& [name, value] : rows(statistics)) {
    out += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>", escapedHtml(name), escapedHtml(value));
  }
  return out + "</dl>\n";
}

std::string number(size_t index) {
  return fmt::format("{:06}", index);
}

std::string galleryHtml(const std::vector<FramePage>& frames, bool has_detections) {
  std::map<std::string, std::vector<size_t>> by_camera;
  for (size_t i = 0; i < frames.size(); ++i) {
    by_camera[frames[i].camera].push_back(i);
  }
  std::string out;
  for (const auto& [camera, indices] : by_camera) {
    out += fmt::format("<h2>{}</h2>\n<div class=\"gallery\">\n", escapedHtml(camera));
    for (const size_t i : indices) {
      const FramePage& frame = frames[i];
      const std::string name = escapedHtml(fs::path(frame.image).stem().string());
      const std::string note =
          has_detections ? fmt::format("{}/{} found", frame.found.counted, frame.found.total)
                         : fmt::format("{} labels", frame.labels);
      out += fmt::format(
          "<a href=\"#frame-{}\"><img loading=\"lazy\" src=\"thumbs/{}.png\" alt=\"frame "
          "{}\"><span><b>{}"
          "</b>{}</span></a>\n",
          i,
          number(i),
          name,
          name,
          note);
    }
    out += "</div>\n";
  }
  return out;
}

/// The data folder as seen from `out` if both move together (one inside the other, or side by
/// side), else nothing.
std::optional<std::string> dataFrom(const fs::path& out, const fs::path& data) {
  const std::string data_from_out = data.lexically_relative(out).generic_string();
  const std::string out_from_data = out.lexically_relative(data).generic_string();
  if (!data_from_out.starts_with("..") || !out_from_data.starts_with("..") ||
      out.parent_path() == data.parent_path()) {
    return data_from_out;
  }
  return std::nullopt;
}

/// What the dataset shows: "room" of its preset's version "room/2"; empty if its manifest does not
/// say.
std::string sceneOf(const ordered_json& manifest) {
  const auto config = manifest.find("config");
  if (config == manifest.end() || !config->is_object()) {
    return "";
  }
  const auto scene = config->find("scene");
  if (scene == config->end() || !scene->is_string()) {
    return "";
  }
  const auto version = scene->get<std::string>();
  return version.substr(0, version.rfind('/'));
}

fs::path resolved(const std::string& path) {
  fs::path absolute = fs::weakly_canonical(fs::absolute(path)).lexically_normal();
  return absolute.has_filename() ? absolute : absolute.parent_path();  // no slash at the end
}

}  // namespace

Report writeReport(const Dataset& dataset,
                   const std::optional<DetectionSource>& detections,
                   const ReportOptions& options) {
  const fs::path data = resolved(dataset.folder());
  const fs::path out = resolved(options.out);
  if (out == data) {
    throw InputError(options.out + ": the report can't be written over the data folder itself");
  }

  Summary summary(options.evaluation);
  std::vector<FramePage> frames;
  std::vector<LabelRecord> records;
  const DetectionSource none = [] {
    return [](size_t, const LabelRecord&) { return Detections{}; };
  };
  evaluateFrames(
      dataset,
      detections.value_or(none),
      options.evaluation,
      options.jobs,
      [&](FrameEvaluation&& frame) {
        FramePage page;
        page.image = frame.labels.image;
        page.camera = cameraName(frame.labels);
        page.labels = frame.labels.lines.size();
        for (size_t i = 0; i < frame.outcome.strata.size(); ++i) {
          if (frame.outcome.strata[i] == Stratum::kHeadline) {
            page.found += {frame.outcome.labels.back()[i].found ? 1 : 0, 1};
          }
        }
        const Camera& camera = dataset.camera(frame.labels);
        page.script = "dlsdFrame(" + scriptJson(frameJson(frames.size(), frame, camera)) + ");\n";
        page.thumbnail_png = encodePng(shrunk(dataset.image(frame.labels), kThumbnailPx));
        summary.add(frame, camera);
        frames.push_back(std::move(page));
        records.push_back(std::move(frame.labels));
      });
  Report report{.index_path = options.out + "/index.html",
                .statistics = labelStatistics(records),
                .summary = std::nullopt};

  const std::optional<std::string> data_from_out = dataFrom(out, data);
  makeFolders(options.out + "/frames");
  makeFolders(options.out + "/thumbs");
  ordered_json index{{"hasDetections", detections.has_value()},
                     {"rho", options.evaluation.rho_px},
                     {"frames", ordered_json::array()}};
  for (size_t i = 0; i < frames.size(); ++i) {
    const FramePage& frame = frames[i];
    const std::string script = "frames/" + number(i) + ".js";
    writeFileAtomically(options.out + "/" + script, frame.script);
    writeFileAtomically(options.out + "/thumbs/" + number(i) + ".png", frame.thumbnail_png);
    std::string image = data_from_out ? *data_from_out + "/" + frame.image : "";
    if (!data_from_out) {
      image = "images/" + number(i) + fs::path(frame.image).extension().string();
      makeFolders(options.out + "/images");
      writeFileAtomically(options.out + "/" + image,
                          readFile(dataset.folder() + "/" + frame.image));
    }
    index["frames"].push_back({{"name", fs::path(frame.image).stem().string()},
                               {"camera", frame.camera},
                               {"image", urlOf(image)},
                               {"script", script}});
  }

  const std::string scene = sceneOf(dataset.manifest());
  const std::string folder = data.filename().string();
  const std::string title = fmt::format("{}, {} frame{}",
                                        scene.empty() ? folder : scene,
                                        frames.size(),
                                        frames.size() == 1 ? "" : "s");
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{} - dlsd "
      "report</title>\n<style>{}</style></head>\n<body><main>\n<h1>{}{}</h1>\n",
      escapedHtml(title),
      kReportStyle,
      escapedHtml(title),
      scene.empty() ? "" : "<small>" + escapedHtml(folder) + "</small>");
  page += detections ? fmt::format("<p>Detections: {}</p>\n", escapedHtml(options.detections_title))
                     : "<p>Labels only</p>\n";
  page += summaryHtml(summary, detections.has_value());
  page += "<h2>Dataset</h2>\n" + statisticsHtml(report.statistics);
  page += galleryHtml(frames, detections.has_value());
  page += "</main>\n";
  page += kReportViewer;
  page += "<script>const report = " + scriptJson(index) + ";</script>\n<script>";
  page += kReportScript;
  page += "</script>\n</body></html>\n";
  writeFileAtomically(report.index_path, page);
  if (detections) {
    report.summary = std::move(summary);
  }
  return report;
}

std::string table(const LabelStatistics& statistics) {
  std::string out;
  for (const auto& [name, value] : rows(statistics)) {
    out += fmt::format("{:<44}  {}\n", name, value);
  }
  return out;
}

}  // namespace dlsd
