// Plain text, lines of words: COLMAP's cameras.txt, the camera.txt of TUM mono and DSO, OCamCalib's
// calib_results.txt.
#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

#include "cameras/calibration/formats.h"
#include "cameras/mutant.h"

namespace dlsd::calib {

Field TextLine::word(const std::string& source, size_t index, std::string_view name) const {
  return {words.at(index), source, "line " + std::to_string(number) + ": " + std::string(name)};
}

namespace {

[[noreturn]] void failLine(const Document& document,
                           const TextLine& line,
                           const std::string& problem) {
  Field(document.root, document.source, "line " + std::to_string(line.number)).fail(problem);
}

const TextLine& lineAt(const Document& document, size_t index, std::string_view what) {
  if (index >= document.lines.size()) {
    document.field().fail("ends before the line with " + std::string(what));
  }
  return document.lines[index];
}

void expectEnd(const Document& document, size_t count) {
  if (document.lines.size() > count) {
    failLine(document, document.lines[count], "is one line more than the format has");
  }
}

// COLMAP

/// Parameters in the file's order by our names; "f" is fx and fy, "k4=0" is one that we have no
/// model for, unless it is 0. Ours that are not there are 0.
struct ColmapModel {
  std::string_view name;
  std::string_view model;
  std::array<std::string_view, 12> params;
};
constexpr std::array<ColmapModel, 14> kColmapModels{{
    // Of those for one model of ours, the first that can say a camera is written.
    {"PINHOLE", "pinhole", {"fx", "fy", "cx", "cy"}},
    {"SIMPLE_PINHOLE", "pinhole", {"f", "cx", "cy"}},
    {"OPENCV", "pinhole_radtan", {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"}},
    {"FULL_OPENCV",
     "pinhole_radtan",
     {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4=0", "k5=0", "k6=0"}},
    {"SIMPLE_RADIAL", "pinhole_radtan", {"f", "cx", "cy", "k1"}},
    {"RADIAL", "pinhole_radtan", {"f", "cx", "cy", "k1", "k2"}},
    {"OPENCV_FISHEYE", "kannala_brandt", {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"}},
    {"SIMPLE_RADIAL_FISHEYE", "kannala_brandt", {"f", "cx", "cy", "k1"}},
    {"RADIAL_FISHEYE", "kannala_brandt", {"f", "cx", "cy", "k1", "k2"}},
    {"SIMPLE_FISHEYE", "kannala_brandt", {"f", "cx", "cy"}},
    {"FISHEYE", "kannala_brandt", {"fx", "fy", "cx", "cy"}},
    {"THIN_PRISM_FISHEYE",
     "kannala_brandt",
     {"fx", "fy", "cx", "cy", "k1", "k2", "p1=0", "p2=0", "k3", "k4", "sx1=0", "sy1=0"}},
    {"FOV", "fov", {"fx", "fy", "cx", "cy", "omega"}},
    {"EUCM", "eucm", {"fx", "fy", "cx", "cy", "alpha", "beta"}},
}};
constexpr std::string_view kColmapPanorama =
    "EQUIRECTANGULAR";  // Its parameters are the image size.
constexpr std::string_view kZero = "=0";

size_t countOf(const ColmapModel& m) {
  return static_cast<size_t>(std::find(m.params.begin(), m.params.end(), "") - m.params.begin());
}

bool isCentre(std::string_view param) {
  return param == "cx" || param == "cy";
}

std::vector<double> panoramaParams(double width, double height) {
  return {
      width / (2 * std::numbers::pi), height / std::numbers::pi, (width - 1) / 2, (height - 1) / 2};
}

Camera readColmapCamera(const Document& document, const TextLine& line) {
  constexpr size_t kFirstParam = 4;
  const auto word = [&](size_t i, std::string_view name) {
    return line.word(document.source, i, name);
  };
  if (line.words.size() < kFirstParam) {
    failLine(document, line, "must be CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
  }
  std::vector<std::string_view> names = column(kColmapModels, &ColmapModel::name);
  names.push_back(kColmapPanorama);
  const size_t model = word(1, "MODEL").oneOf(names);
  const std::pair<int, int> size{word(2, "WIDTH").imageSize(), word(3, "HEIGHT").imageSize()};
  const auto expect_count = [&](size_t count, std::span<const std::string_view> params) {
    if (line.words.size() - kFirstParam != count) {
      failLine(document,
               line,
               "has " + std::to_string(line.words.size() - kFirstParam) + " parameters, " +
                   std::string(names[model]) + " needs " + std::to_string(count) + ": " +
                   listed(params));
    }
  };
  const Field place(document.root, document.source, "line " + std::to_string(line.number));
  if (names[model] == kColmapPanorama) {
    constexpr std::array<std::string_view, 2> kParams{"w", "h"};
    expect_count(2, kParams);
    (void)word(kFirstParam, "w").integer(size.first, size.first, true);
    (void)word(kFirstParam + 1, "h").integer(size.second, size.second, true);
    return place.camera("equirectangular", panoramaParams(size.first, size.second), size);
  }
  const ColmapModel& m = kColmapModels.at(model);
  const size_t count = countOf(m);
  expect_count(count, std::span(m.params).first(count));
  const std::span<const ParamSpec> specs = paramSpecsOf(m.model);
  std::vector<double> params(specs.size(), 0);
  const auto set = [&](std::string_view name, double value) {
    params[static_cast<size_t>(&specOf(m.model, name) - specs.data())] = value;
  };
  for (size_t i = 0; i < count; ++i) {
    const std::string_view name = m.params.at(i);
    const Field value = word(kFirstParam + i, name.substr(0, name.find('=')));
    if (name.ends_with(kZero)) {
      (void)value.number({0, 0, ""});
    } else if (name == "f") {
      set("fx", value.number(allowedBy(specOf(m.model, "fx"))));
      set("fy", value.number(allowedBy(specOf(m.model, "fy"))));
    } else {
      const Allowed allowed = allowedBy(specOf(m.model, name));
      set(name, isCentre(name) ? value.numberFromCorner(allowed) : value.number(allowed));
    }
  }
  return place.camera(m.model, params, size);
}

/// COLMAP's own header says how many cameras follow: a file cut off between two of them is known by
/// it.
void checkColmapCount(const Document& document, size_t cameras) {
  constexpr std::string_view kHeader = "# Number of cameras:";
  const size_t at = document.text.find(kHeader);
  if (at == std::string::npos) return;
  const size_t begin = at + kHeader.size();
  std::string text = document.text.substr(begin, document.text.find('\n', begin) - begin);
  text.erase(std::remove_if(text.begin(), text.end(), [](char c) { return c == ' ' || c == '\r'; }),
             text.end());
  if (text != std::to_string(cameras)) {
    document.field().fail("holds " + std::to_string(cameras) + " cameras, but its header says " +
                          inQuotes(text));
  }
}

// TUM mono and DSO

struct TumModel {
  std::string_view word;
  std::string_view model;  ///< pinhole: the fifth number is 0.
  size_t count;            ///< Numbers on the line.
};
constexpr std::array<TumModel, 5> kTumModels{{{"FOV", "fov", 5},
                                              {"Pinhole", "pinhole", 5},
                                              {"RadTan", "pinhole_radtan", 8},
                                              {"EquiDistant", "kannala_brandt", 8},
                                              {"KannalaBrandt", "kannala_brandt", 8}}};

bool isNumber(const Node& node) {
  return parseNumber(node.text).has_value();
}

/// The row of a first line; its numbers begin at word `first`.
const TumModel& tumModelOf(const Document& document, const TextLine& line, size_t* first) {
  const std::string& word = line.words.front().text;
  const auto* const named = std::find_if(
      kTumModels.begin(), kTumModels.end(), [&](const TumModel& m) { return m.word == word; });
  *first = named != kTumModels.end() ? 1 : 0;
  const size_t count = line.words.size() - *first;
  // Without a word, as DSO reads it: 8 numbers are RadTan, 5 are FOV, or Pinhole if the last is 0.
  const TumModel* model = named;
  if (named == kTumModels.end()) {
    if (!isNumber(line.words.front()) || (count != 5 && count != 8)) {
      failLine(document,
               line,
               "must be 5 or 8 numbers, after one of FOV, Pinhole, RadTan, EquiDistant, "
               "KannalaBrandt or none");
    }
    const bool zero = count == 5 && parseNumber(line.words.back().text) == 0.0;
    model = &kTumModels.at(count == 8 ? 2 : (zero ? 1 : 0));
  }
  if (count != model->count) {
    failLine(document,
             line,
             "has " + std::to_string(count) + " numbers, " + std::string(model->word) + " needs " +
                 std::to_string(model->count));
  }
  return *model;
}

// OCamCalib

/// The numbers of a line, one for each name.
std::vector<double> numbersOf(const Document& document,
                              const TextLine& line,
                              std::span<const std::string_view> names,
                              std::span<const Allowed> allowed) {
  if (line.words.size() != names.size()) {
    failLine(document,
             line,
             "has " + std::to_string(line.words.size()) + " numbers, needed are " + listed(names));
  }
  std::vector<double> values;
  for (size_t i = 0; i < names.size(); ++i) {
    values.push_back(line.word(document.source, i, names[i]).number(allowed[i]));
  }
  return values;
}

/// A line "n c0 c1 ... c(n-1)"; allowed: of each coefficient, at most so many.
std::vector<double> polynomialOf(const Document& document,
                                 const TextLine& line,
                                 std::span<const Allowed> allowed,
                                 std::string_view name) {
  const int count = line.word(document.source, 0, "number of coefficients")
                        .integer(1, static_cast<int>(allowed.size()));
  if (line.words.size() != static_cast<size_t>(count) + 1) {
    failLine(document,
             line,
             "has " + std::to_string(line.words.size() - 1) + " coefficients, but says " +
                 std::to_string(count));
  }
  std::vector<double> values;
  for (size_t i = 0; i + 1 < line.words.size(); ++i) {
    values.push_back(line.word(document.source, i + 1, std::string(name) + std::to_string(i))
                         .number(allowed[i]));
  }
  return values;
}

}  // namespace

bool isColmap(const Document& document) {
  if (document.lines.empty()) return false;
  const std::vector<Node>& words = document.lines.front().words;
  const auto all = [](const std::string& text, auto predicate) {
    return std::all_of(text.begin(), text.end(), predicate);
  };
  return words.size() >= 2 && all(words[0].text, [](char c) { return c >= '0' && c <= '9'; }) &&
         words[1].text[0] >= 'A' && words[1].text[0] <= 'Z' &&
         all(words[1].text, [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
}

Loaded readColmap(const Document& document) {
  Loaded loaded;
  loaded.from_corner = true;
  std::vector<std::string> seen;
  for (const TextLine& line : document.lines) {
    constexpr int kMaxId = 999'999'999;  // As in cam999999999.
    const int id = line.word(document.source, 0, "CAMERA_ID").integer(0, kMaxId);
    seen.push_back("cam" + std::to_string(id));
    loaded.cameras.push_back({seen.back(), readColmapCamera(document, line)});
  }
  checkColmapCount(document, loaded.cameras.size());
  if (loaded.cameras.empty()) document.field().fail("holds no camera");
  std::sort(seen.begin(), seen.end());
  if (const auto twice = std::adjacent_find(seen.begin(), seen.end()); twice != seen.end()) {
    document.field().fail("CAMERA_ID " + twice->substr(3) + " is given twice, allowed is once");
  }
  return loaded;
}

std::string writeColmap(const std::vector<NamedCamera>& cameras) {
  std::string text =
      "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, "
      "PARAMS[]\n# Number of cameras: " +
      std::to_string(cameras.size()) + "\n";
  for (const NamedCamera& entry : cameras) {
    const Camera& camera = entry.camera;
    if (camera.maxFieldAngleLimit() < M_PI) {
      throw std::invalid_argument(entry.name + ": colmap cannot say max_field_angle = " +
                                  shortest(camera.maxFieldAngleLimit()) +
                                  " rad: please remove it from the camera first");
    }
    const std::vector<double> params = camera.params();
    const std::span<const ParamSpec> specs = camera.paramSpecs();
    text += std::to_string(cameraNumber(entry.name).value()) + " ";
    std::string size = " ";
    size += std::to_string(camera.width()) + " " + std::to_string(camera.height());
    if (camera.modelName() == "equirectangular" &&
        params == panoramaParams(camera.width(), camera.height())) {
      text += std::string(kColmapPanorama) + size + size + "\n";
      continue;
    }
    const auto* const known =
        std::find_if(kColmapModels.begin(), kColmapModels.end(), [&](const ColmapModel& m) {
          if (m.model != camera.modelName()) return false;
          for (size_t i = 0; i < specs.size(); ++i) {
            if (params[i] != 0 &&
                std::find(m.params.begin(), m.params.end(), specs[i].name) == m.params.end())
              return false;
          }
          return true;
        });
    if (known == kColmapModels.end()) {
      std::vector<std::string_view> models;
      for (const ColmapModel& m : kColmapModels) {
        if (std::find(models.begin(), models.end(), m.model) == models.end())
          models.push_back(m.model);
      }
      models.emplace_back("equirectangular over the whole image");
      refuseModel(entry, "colmap", models);
    }
    text += std::string(known->name) + size;
    for (size_t i = 0; i < countOf(*known); ++i) {
      const std::string_view name = known->params.at(i);
      std::string value = "0";
      if (!name.ends_with(kZero)) {
        value = shortest(params[static_cast<size_t>(&specOf(known->model, name) - specs.data())]);
        if (isCentre(name) && !DLSD_MUTANT("write-half-pixel")) value = plusHalf(value);
      }
      text += " " + value;
    }
    text += "\n";
  }
  return text;
}

bool isTum(const Document& document) {
  if (document.lines.empty()) return false;
  const TextLine& line = document.lines.front();
  const bool named = std::any_of(kTumModels.begin(), kTumModels.end(), [&](const TumModel& m) {
    return m.word == line.words.front().text;
  });
  return named || ((line.words.size() == 5 || line.words.size() == 8) &&
                   std::all_of(line.words.begin(), line.words.end(), isNumber));
}

Loaded readTum(const Document& document) {
  const TextLine& line = lineAt(document, 0, "fx fy cx cy ...");
  size_t first = 0;
  const TumModel& m = tumModelOf(document, line, &first);
  const TextLine& size_line = lineAt(document, 1, "width and height");
  if (size_line.words.size() != 2) failLine(document, size_line, "must be width and height");
  const std::pair<int, int> size{size_line.word(document.source, 0, "width").imageSize(),
                                 size_line.word(document.source, 1, "height").imageSize()};
  const TextLine& output = lineAt(document, 2, "crop, full, none or fx fy cx cy 0");
  if (output.words.size() == 1) {
    constexpr std::array<std::string_view, 3> kModes{"crop", "full", "none"};
    (void)output.word(document.source, 0, "mode").oneOf(kModes);
  } else {
    constexpr std::array<std::string_view, 5> kNames{"fx", "fy", "cx", "cy", "0"};
    constexpr std::array<Allowed, 5> kAny{
        {{-1e9, 1e9, ""}, {-1e9, 1e9, ""}, {-1e9, 1e9, ""}, {-1e9, 1e9, ""}, {0, 0, ""}}};
    (void)numbersOf(document, output, kNames, kAny);
  }
  const TextLine& output_size = lineAt(document, 3, "width and height of the output");
  if (output_size.words.size() != 2)
    failLine(document, output_size, "must be width and height of the output");
  (void)output_size.word(document.source, 0, "width").imageSize();
  (void)output_size.word(document.source, 1, "height").imageSize();
  expectEnd(document, 4);

  const std::span<const ParamSpec> specs = paramSpecsOf(m.model);
  const std::span<const ParamSpec> pinhole = paramSpecsOf("pinhole");
  const auto word = [&](size_t i, std::string_view name) {
    return line.word(document.source, first + i, name);
  };
  // DSO: relative to width and height, unless cx and cy are larger than 1.
  const Allowed any{-1e9, 1e9, ""};
  const double cx = word(2, "cx").number(any);
  const double cy = word(3, "cy").number(any);
  if ((cx > 1) != (cy > 1)) {
    failLine(document,
             line,
             "has cx = " + shortest(cx) + " and cy = " + shortest(cy) +
                 ", allowed are both relative to the image size (up to 1) or both in pixels "
                 "(larger than 1)");
  }
  Loaded loaded;
  loaded.from_corner = cx <= 1;
  std::vector<double> params;
  for (size_t i = 0; i < 4; ++i) {
    const Allowed in_px = allowedBy(pinhole[i]);
    const double scale = i % 2 == 0 ? size.first : size.second;
    const double shift = i >= 2 ? 0.5 : 0;
    if (loaded.from_corner) {
      params.push_back(word(i, pinhole[i].name)
                               .number({(in_px.min + shift) / scale,
                                        (in_px.max + shift) / scale,
                                        "of the image size"}) *
                           scale -
                       shift);
    } else {
      params.push_back(word(i, pinhole[i].name).number(in_px));
    }
  }
  for (size_t i = 4; i < m.count; ++i) {
    if (m.model == "pinhole") {
      (void)word(i, "fifth number").number({0, 0, ""});
    } else {
      params.push_back(word(i, specs[i].name).number(allowedBy(specs[i])));
    }
  }
  params.resize(specs.size(), 0);
  const Field place(document.root, document.source, "line " + std::to_string(line.number));
  loaded.cameras.push_back({"cam0", place.camera(m.model, params, size)});
  return loaded;
}

bool isOcamcalib(const Document& document) {
  if (document.lines.empty()) return false;
  const std::vector<Node>& words = document.lines.front().words;
  return words.size() >= 2 && words.front().text == std::to_string(words.size() - 1) &&
         std::all_of(words.begin(), words.end(), isNumber);
}

Loaded readOcamcalib(const Document& document) {
  constexpr std::array<std::string_view, 2> kCentre{"row of the centre", "column of the centre"};
  constexpr std::array<std::string_view, 3> kAffine{"c", "d", "e"};
  constexpr size_t kCoefficients = 9;
  constexpr size_t kMaxInverse = 100;
  std::vector<Allowed> allowed;  // a0 ... a8, cx, cy, c, d, e
  for (const ParamSpec& spec : paramSpecsOf("ocam")) allowed.push_back(allowedBy(spec));
  const std::span<const Allowed> all = allowed;
  const std::array<Allowed, 2> row_and_column{all[kCoefficients + 1], all[kCoefficients]};
  std::vector<double> params =
      polynomialOf(document, lineAt(document, 0, "the polynomial"), all.first(kCoefficients), "a");
  params.resize(kCoefficients, 0);
  // A fit to the first polynomial: nothing new is in it.
  const std::vector<Allowed> any(kMaxInverse, {-1e300, 1e300, ""});
  (void)polynomialOf(document, lineAt(document, 1, "the inverse polynomial"), any, "b");
  const std::vector<double> centre = numbersOf(
      document, lineAt(document, 2, "row and column of the centre"), kCentre, row_and_column);
  params.insert(params.end(), centre.rbegin(), centre.rend());
  for (const double x :
       numbersOf(document, lineAt(document, 3, "c, d and e"), kAffine, all.last(3))) {
    params.push_back(x);
  }
  const TextLine& size = lineAt(document, 4, "height and width");
  if (size.words.size() != 2) failLine(document, size, "must be height and width");
  const int height = size.word(document.source, 0, "height").imageSize();
  const int width = size.word(document.source, 1, "width").imageSize();
  expectEnd(document, 5);
  return {{{"cam0", document.field().camera("ocam", params, {width, height})}}};
}

}  // namespace dlsd::calib
