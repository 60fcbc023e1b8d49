#include "evaluation/paper_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "cameras/calibration/files.h"
#include "evaluation/evaluation_page.h"
#include "evaluation/summary.h"
#include "evaluation/svg_plot.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using nlohmann::ordered_json;

constexpr double kRadians = M_PI / 180;
/// A line corresponds to another one if this share of it lies within the paper's rho.
constexpr double kPaperShare = 0.9;
constexpr double kTablePercent = 25;

struct LineFacts {
  double angle_rad;
  std::array<bool, kPaperRhosPx.size()> right;
  std::vector<bool> recovered_by;  ///< [detector]
};

struct LabelFacts {
  double angle_rad;
  bool counts;  ///< Neither faint nor crowded.
  bool in_view;
  std::vector<std::array<bool, kPaperRhosPx.size()>> found;  ///< [detector]
};

struct FrameFacts {
  std::vector<std::vector<LineFacts>> lines;  ///< [detector]
  std::vector<LabelFacts> labels;
};

bool isInView(const VirtualView& view, const Camera& camera, const std::vector<Vector2d>& points) {
  return std::all_of(points.begin(), points.end(), [&](const Vector2d& p) {
    const auto ray = camera.unproject(p);
    const auto pixel = ray ? view.pixelOf(*ray) : std::nullopt;
    return pixel && pixel->x() >= -0.5 && pixel->x() <= view.width - 0.5 && pixel->y() >= -0.5 &&
           pixel->y() <= view.height - 0.5;
  });
}

MeanAndDeviation meanOf(const std::vector<double>& values) {
  MeanAndDeviation result;
  result.count = long(values.size());
  for (const double value : values) {
    result.mean += value / double(values.size());
  }
  for (const double value : values) {
    result.deviation += (value - result.mean) * (value - result.mean);
  }
  result.deviation =
      values.size() > 1 ? std::sqrt(result.deviation / double(values.size() - 1)) : 0;
  return result;
}

FrameFacts factsOf(const LabelRecord& labels,
                   const Camera& camera,
                   const std::vector<std::vector<DetectionLine>>& lines,
                   const std::vector<FrameOutcome>& outcomes,
                   const std::vector<ExperimentDetector>& detectors,
                   const std::optional<VirtualView>& view) {
  FrameFacts facts;
  for (size_t d = 0; d < detectors.size(); ++d) {
    const FrameOutcome& outcome = outcomes[d];
    if (d == 0) {
      for (size_t i = 0; i < labels.lines.size(); ++i) {
        const LabelConditions& conditions = outcome.conditions[i];
        facts.labels.push_back({labels.lines[i].angle_rad,
                                !conditions.faint && !conditions.crowded,
                                !view || isInView(*view, camera, labels.lines[i].points),
                                {}});
      }
    }
    for (size_t i = 0; i < labels.lines.size(); ++i) {
      auto& found = facts.labels[i].found.emplace_back();
      for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
        found[r] = outcome.labels[r][i].found;
      }
    }
    auto& own = facts.lines.emplace_back();
    for (size_t i = 0; i < lines[d].size(); ++i) {
      LineFacts& line = own.emplace_back();
      line.angle_rad = outcome.detection_angle_rad[i];
      for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
        line.right[r] = outcome.detections[r][i].right;
      }
    }
    for (size_t other = 0; other < detectors.size(); ++other) {
      const std::vector<bool> covered =
          detectors[other].ours && other != d
              ? coveredByOne(camera, lines[d], lines[other], kPaperRhosPx.back(), kPaperShare)
              : std::vector<bool>(lines[d].size());
      for (size_t i = 0; i < own.size(); ++i) {
        own[i].recovered_by.push_back(covered[i]);
      }
    }
  }
  return facts;
}

ExperimentRow rowOf(const std::vector<FrameFacts>& frames,
                    size_t detectors,
                    double field_deg,
                    double percent) {
  ExperimentRow row;
  row.field_deg = field_deg;
  row.percent = percent;
  row.min_angle_rad = percent / 100 * field_deg * kRadians;
  for (size_t d = 0; d < detectors; ++d) {
    ExperimentRow::OfDetector& sums = row.detectors.emplace_back();
    sums.recovered_by.resize(detectors);
    std::vector<double> recall_sum(detectors);
    long images = 0;
    for (const FrameFacts& frame : frames) {
      std::vector<Ratio> recovered(detectors);
      for (const LineFacts& line : frame.lines[d]) {
        if (!(line.angle_rad >= row.min_angle_rad)) {
          continue;
        }
        ++sums.lines;
        for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
          sums.right[r] += {line.right[r] ? 1 : 0, 1};
        }
        for (size_t other = 0; other < detectors; ++other) {
          recovered[other] += {line.recovered_by[other] ? 1 : 0, 1};
        }
      }
      images += recovered[0].total > 0 ? 1 : 0;
      for (size_t other = 0; other < detectors; ++other) {
        sums.recovered_by[other] += recovered[other];
        if (recovered[other].total > 0) {
          recall_sum[other] += double(recovered[other].counted) / double(recovered[other].total);
        }
      }
      for (const LabelFacts& label : frame.labels) {
        if (!label.counts || !(label.angle_rad >= row.min_angle_rad)) {
          continue;
        }
        for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
          const Ratio one{label.found[d][r] ? 1 : 0, 1};
          sums.found[r] += one;
          if (label.in_view) {
            sums.found_in_view[r] += one;
          }
        }
      }
    }
    for (size_t other = 0; other < detectors; ++other) {
      sums.mean_recovered_by.push_back(
          images > 0 ? std::optional(recall_sum[other] / double(images)) : std::nullopt);
    }
  }
  return row;
}

std::string timeText(const MeanAndDeviation& time) {
  return time.count > 0 ? fmt::format("{:.2f} ({:.2f})", time.mean, time.deviation) : "-";
}

/// The time that detectors on rectified images spend before they start: of the first of them, they
/// all do the same.
std::string rectificationText(const Experiment& experiment) {
  for (const MeanAndDeviation& time : experiment.rectification_ms) {
    if (time.count > 0) {
      return timeText(time);
    }
  }
  return "-";
}

std::string percentText(const Ratio& ratio) {
  return ratio.total > 0 ? fmt::format("{:.1f}", 100 * double(ratio.counted) / double(ratio.total))
                         : "-";
}

/// "RHO px" columns of the truth.
const std::array<
    std::pair<const char*, std::array<Ratio, kPaperRhosPx.size()> ExperimentRow::OfDetector::*>,
    3>
    kTruths{{{"labels found", &ExperimentRow::OfDetector::found},
             {"labels in the rectified view found", &ExperimentRow::OfDetector::found_in_view},
             {"lines right", &ExperimentRow::OfDetector::right}}};

ordered_json toJson(const Ratio& ratio) {
  return {{"counted", ratio.counted}, {"total", ratio.total}};
}

ordered_json toJson(const MeanAndDeviation& time) {
  return {{"images", time.count}, {"mean", time.mean}, {"standard_deviation", time.deviation}};
}

ordered_json toJson(const Experiment& experiment) {
  ordered_json times = ordered_json::array();
  for (size_t d = 0; d < experiment.detectors.size(); ++d) {
    ordered_json j{{"detector", experiment.detectors[d]}};
    for (const auto& [key, time] :
         {std::pair("detection_ms", &experiment.detection_ms[d]),
          std::pair("rectification_ms", &experiment.rectification_ms[d])}) {
      if (time->count > 0) {
        j[key] = toJson(*time);
      }
    }
    times.push_back(std::move(j));
  }
  ordered_json rows = ordered_json::array();
  for (const ExperimentRow& row : experiment.rows) {
    for (size_t d = 0; d < experiment.detectors.size(); ++d) {
      const ExperimentRow::OfDetector& sums = row.detectors[d];
      ordered_json j{{"field_deg", row.field_deg},
                     {"percent", row.percent},
                     {"min_angle_deg", row.min_angle_rad / kRadians},
                     {"detector", experiment.detectors[d]},
                     {"lines", sums.lines}};
      for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
        const std::string at = fmt::format("_at_{:g}px", kPaperRhosPx[r]);
        j["right" + at] = toJson(sums.right[r]);
        j["found" + at] = toJson(sums.found[r]);
        j["found_in_view" + at] = toJson(sums.found_in_view[r]);
      }
      for (size_t other = 0; other < experiment.detectors.size(); ++other) {
        if (experiment.ours[other] && other != d) {
          ordered_json recovered = toJson(sums.recovered_by[other]);
          if (sums.mean_recovered_by[other]) {
            recovered["mean_over_images"] = *sums.mean_recovered_by[other];
          }
          j["recovered_by_" + experiment.detectors[other]] = std::move(recovered);
        }
      }
      rows.push_back(std::move(j));
    }
  }
  return {{"format", "dlsd-experiment/1"},
          {"frames", experiment.frames},
          {"times", std::move(times)},
          {"rows", std::move(rows)}};
}

std::string toCsv(const Experiment& experiment) {
  std::string out = "field_deg,percent,min_angle_deg,detector,figure,counted,total\n";
  for (const ExperimentRow& row : experiment.rows) {
    for (size_t d = 0; d < experiment.detectors.size(); ++d) {
      const ExperimentRow::OfDetector& sums = row.detectors[d];
      const auto line = [&](const std::string& figure, const Ratio& ratio) {
        out += fmt::format("{:g},{:g},{:g},{},{},{},{}\n",
                           row.field_deg,
                           row.percent,
                           row.min_angle_rad / kRadians,
                           experiment.detectors[d],
                           figure,
                           ratio.counted,
                           ratio.total);
      };
      for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
        const std::string at = fmt::format(" at {:g} px", kPaperRhosPx[r]);
        line("lines right" + at, sums.right[r]);
        line("labels found" + at, sums.found[r]);
        line("labels in view found" + at, sums.found_in_view[r]);
      }
      for (size_t other = 0; other < experiment.detectors.size(); ++other) {
        if (experiment.ours[other] && other != d) {
          line("lines recovered by " + experiment.detectors[other], sums.recovered_by[other]);
        }
      }
    }
  }
  return out;
}

std::string tableHtml(const std::vector<std::string>& columns,
                      const std::vector<std::vector<std::string>>& rows) {
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (const std::string& column : columns) {
    out += "<th>" + escapedHtml(column) + "</th>";
  }
  out += "</tr></thead><tbody>";
  for (const auto& row : rows) {
    out += "<tr>";
    for (const std::string& text : row) {
      out += "<td>" + escapedHtml(text) + "</td>";
    }
    out += "</tr>";
  }
  return out + "</tbody></table></div>\n";
}

/// Share over least length, one series per detector for which `of` has a ratio.
std::string sharePlot(const Experiment& experiment,
                      double field_deg,
                      const std::string& title,
                      const std::function<std::optional<Ratio>(const ExperimentRow&, size_t)>& of) {
  std::vector<PlotSeries> series;
  for (size_t d = 0; d < experiment.detectors.size(); ++d) {
    PlotSeries& one = series.emplace_back();
    one.name = experiment.detectors[d];
    for (const double percent : kPaperPercents) {
      const std::optional<Ratio> ratio = of(experiment.row(field_deg, percent), d);
      if (ratio && ratio->total > 0) {
        one.points.push_back({percent, double(ratio->counted) / double(ratio->total)});
      }
    }
  }
  return linePlot(title,
                  {.title = fmt::format("least length, % of {:g} degrees", field_deg),
                   .from = 0,
                   .to = kPaperPercents.back()},
                  shareAxis("share", series),
                  series);
}

/// Table 1: heading and cells.
std::vector<std::vector<std::string>> tableOne(const Experiment& experiment) {
  std::vector<std::vector<std::string>> rows;
  rows.push_back({"", "rectification"});
  for (const std::string& name : experiment.detectors) {
    rows[0].push_back(name);
  }
  for (const double field : kPaperFieldsDeg) {
    const ExperimentRow& row = experiment.row(field, kTablePercent);
    auto& cells = rows.emplace_back(std::vector<std::string>{
        fmt::format("lines >= {:g} deg", row.min_angle_rad / kRadians), "-"});
    for (const ExperimentRow::OfDetector& sums : row.detectors) {
      cells.push_back(fmt::format("{}", sums.lines));
    }
  }
  auto& times = rows.emplace_back(
      std::vector<std::string>{"time, ms: mean (sd)", rectificationText(experiment)});
  for (const MeanAndDeviation& time : experiment.detection_ms) {
    times.push_back(timeText(time));
  }
  return rows;
}

}  // namespace

Camera paperCamera() {
  return {Fov::fromParams({446.915863, 447.071228, 631.219238, 510.997498, 0.933271}), 1280, 1024};
}

const ExperimentRow& Experiment::row(double field_deg, double percent) const {
  const auto it = std::find_if(rows.begin(), rows.end(), [&](const ExperimentRow& r) {
    return r.field_deg == field_deg && r.percent == percent;
  });
  if (it == rows.end()) {
    throw std::invalid_argument("the experiment has no such row");
  }
  return *it;
}

Experiment runPaperExperiment(const Dataset& dataset,
                              const std::vector<ExperimentDetector>& detectors,
                              const std::optional<VirtualView>& view,
                              const std::function<void(size_t done)>& on_progress) {
  EvaluationOptions options;
  options.rho_px.assign(kPaperRhosPx.begin(), kPaperRhosPx.end());
  Experiment experiment;
  std::vector<FrameDetections> run;
  for (const ExperimentDetector& detector : detectors) {
    experiment.detectors.push_back(detector.name);
    experiment.ours.push_back(detector.ours);
    run.push_back(detector.source());
  }
  std::vector<std::vector<double>> detection_ms(detectors.size()),
      rectification_ms(detectors.size());
  std::vector<FrameFacts> frames;
  for (size_t i = 0; i < dataset.size(); ++i) {
    const LabelRecord labels = dataset.labels(i);
    const Camera& camera = dataset.camera(labels);
    std::vector<std::vector<DetectionLine>> lines;
    std::vector<FrameOutcome> outcomes;
    for (size_t d = 0; d < detectors.size(); ++d) {
      Detections detections = run[d](i, labels);
      try {
        outcomes.push_back(evaluateFrame(camera, labels.lines, detections.lines, options));
      } catch (const std::invalid_argument& error) {
        throw InputError(fmt::format(
            "{}: {}/{}: {}", detectors[d].name, dataset.folder(), labels.image, error.what()));
      }
      if (detections.time_ms) {
        detection_ms[d].push_back(*detections.time_ms);
      }
      if (detections.rectification_ms) {
        rectification_ms[d].push_back(*detections.rectification_ms);
      }
      lines.push_back(std::move(detections.lines));
    }
    frames.push_back(factsOf(labels, camera, lines, outcomes, detectors, view));
    if (on_progress) {
      on_progress(i + 1);
    }
  }
  experiment.frames = frames.size();
  for (size_t d = 0; d < detectors.size(); ++d) {
    experiment.detection_ms.push_back(meanOf(detection_ms[d]));
    experiment.rectification_ms.push_back(meanOf(rectification_ms[d]));
  }
  for (const double field : kPaperFieldsDeg) {
    for (const double percent : kPaperPercents) {
      experiment.rows.push_back(rowOf(frames, detectors.size(), field, percent));
    }
  }
  return experiment;
}

std::string table(const Experiment& experiment) {
  std::string out;
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string row = fmt::format("{:<22}", cells[0]);
    for (size_t i = 1; i < cells.size(); ++i) {
      row += fmt::format("  {:>14}", cells[i]);
    }
    out += row + "\n";
  };
  out += fmt::format("Table 1 on {} frames\n", experiment.frames);
  for (const auto& cells : tableOne(experiment)) {
    line(cells);
  }
  const auto rows = [&](double field, const auto& cellsOf) {
    for (const double percent : kPaperPercents) {
      const ExperimentRow& row = experiment.row(field, percent);
      std::vector<std::string> cells{
          fmt::format("{:>4g} %  {:>6.2f} deg", percent, row.min_angle_rad / kRadians)};
      for (std::string& cell : cellsOf(row)) {
        cells.push_back(std::move(cell));
      }
      line(cells);
    }
  };
  for (const double field : kPaperFieldsDeg) {
    for (size_t ours = 0; ours < experiment.detectors.size(); ++ours) {
      if (!experiment.ours[ours]) {
        continue;
      }
      out += fmt::format(
          "\nFig. 4: recall of {} in %, of the lines of the others, 100 % = {:g} degrees\n",
          experiment.detectors[ours],
          field);
      std::vector<std::string> heading{"least length"};
      for (size_t d = 0; d < experiment.detectors.size(); ++d) {
        if (d != ours) {
          heading.push_back(experiment.detectors[d]);
        }
      }
      line(heading);
      rows(field, [&](const ExperimentRow& row) {
        std::vector<std::string> cells;
        for (size_t d = 0; d < experiment.detectors.size(); ++d) {
          if (d != ours) {
            cells.push_back(percentText(row.detectors[d].recovered_by[ours]));
          }
        }
        return cells;
      });
    }
  }
  for (size_t r = 0; r < kPaperRhosPx.size(); ++r) {
    for (const auto& [what, ratios] : kTruths) {
      out += fmt::format("\nTrue {} at rho = {:g} px in %, 100 % = {:g} degrees\n",
                         what,
                         kPaperRhosPx[r],
                         kPaperFieldsDeg[1]);
      std::vector<std::string> heading{"least length"};
      for (const std::string& name : experiment.detectors) {
        heading.push_back(name);
      }
      heading.emplace_back(ratios == &ExperimentRow::OfDetector::right ? "" : "labels");
      line(heading);
      rows(kPaperFieldsDeg[1], [&, ratios = ratios](const ExperimentRow& row) {
        std::vector<std::string> cells;
        for (const ExperimentRow::OfDetector& sums : row.detectors) {
          cells.push_back(percentText((sums.*ratios)[r]));
        }
        if (ratios != &ExperimentRow::OfDetector::right && !row.detectors.empty()) {
          cells.push_back(fmt::format("{}", (row.detectors[0].*ratios)[r].total));
        }
        return cells;
      });
    }
  }
  return out;
}

void writeExperiment(const Experiment& experiment,
                     const std::string& title,
                     const std::string& folder) {
  std::string body = fmt::format(
      "<p>{} frames with exact labels. Zu&ntilde;iga-No&euml;l et al., D-LSD, CAIP 2021, section "
      "5. Lengths are angles between the end rays; the paper prints 25 % of the field of view as "
      "61&deg;, 25 % of its 122&deg; are 30.5&deg;: both are shown.</p>\n",
      experiment.frames);
  const auto one = tableOne(experiment);
  body += "<h2>Table 1</h2>\n" + tableHtml(one[0], {one.begin() + 1, one.end()});
  body += plotLegend(experiment.detectors);
  for (size_t ours = 0; ours < experiment.detectors.size(); ++ours) {
    if (!experiment.ours[ours]) {
      continue;
    }
    body += fmt::format(
        "<h2>Fig. 4: recall of {}</h2>\n<p>Lines of the other detectors of which 90 % lie within 4 "
        "px "
        "of one of its lines.</p>\n<div class=\"plots\">\n",
        escapedHtml(experiment.detectors[ours]));
    for (const double field : kPaperFieldsDeg) {
      body += sharePlot(experiment,
                        field,
                        fmt::format("100 % = {:g} degrees", field),
                        [&](const ExperimentRow& row, size_t d) -> std::optional<Ratio> {
                          if (d == ours) {
                            return std::nullopt;
                          }
                          return row.detectors[d].recovered_by[ours];
                        });
    }
    body += "</div>\n";
  }
  body +=
      "<h2>The truth</h2>\n<p>Labels of contrast &ge; 20 grey levels that no other one is nearer "
      "to than 6 px.</p>\n<div class=\"plots\">\n";
  for (size_t r = kPaperRhosPx.size(); r-- > 0;) {
    for (const auto& [what, ratios] : kTruths) {
      body += sharePlot(experiment,
                        kPaperFieldsDeg[1],
                        fmt::format("{}, rho = {:g} px", what, kPaperRhosPx[r]),
                        [&, ratios = ratios](const ExperimentRow& row, size_t d) {
                          return std::optional((row.detectors[d].*ratios)[r]);
                        });
    }
  }
  body += "</div>\n";
  makeFolders(folder);
  writeFileAtomically(folder + "/experiment.csv", toCsv(experiment));
  writeFileAtomically(folder + "/experiment.json", toJson(experiment).dump(1) + "\n");
  writeFileAtomically(folder + "/index.html", pageOf(title, body));
}

}  // namespace dlsd
