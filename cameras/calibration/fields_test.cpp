#include "cameras/calibration/fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cstring>
#include <limits>

#include "cameras/calibration/files.h"

namespace dlsd::calib {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(PlusHalf, AddsAndSubtractsAsInSchool) {
  struct {
    const char* text;
    const char* plus;
    const char* minus;
  } const cases[] = {{"0", "0.5", "-0.5"},
                     {"-0", "0.5", "-0.5"},
                     {"319.5", "320.0", "319.0"},
                     {"0.1", "0.6", "-0.4"},
                     {"-0.1", "0.4", "-0.6"},
                     {"-0.5", "0.0", "-1.0"},
                     {"9.5", "10.0", "9.0"},
                     {"999.75", "1000.25", "999.25"},
                     {"-10", "-9.5", "-10.5"},
                     {"1e3", "1000.5", "999.5"},
                     {"1.25e+2", "125.5", "124.5"},
                     {"5e-1", "1.0", "0.0"},
                     {"1e-5", "0.50001", "-0.49999"},
                     {".25", "0.75", "-0.25"},
                     {"+2.", "2.5", "1.5"},
                     {"0e99999999999999999999", "0.5", "-0.5"},
                     {"254.93170605935475", "255.43170605935475", "254.43170605935475"}};
  for (const auto& c : cases) {
    EXPECT_EQ(plusHalf(c.text), c.plus) << c.text;
    EXPECT_EQ(plusHalf(c.text, -1), c.minus) << c.text;
  }
}

/// Any finite double, all exponents alike.
rc::Gen<double> genDouble() {
  return rc::gen::map(rc::gen::suchThat(rc::gen::arbitrary<uint64_t>(),
                                        [](uint64_t bits) {
                                          double x = 0;
                                          std::memcpy(&x, &bits, sizeof x);
                                          return std::isfinite(x);
                                        }),
                      [](uint64_t bits) {
                        double x = 0;
                        std::memcpy(&x, &bits, sizeof x);
                        return x;
                      });
}

// A sum of doubles would lose the low digits of all but a few numbers.
RC_GTEST_PROP(PlusHalf, ThereAndBackIsTheSameDouble, ()) {
  const double x =
      *rc::gen::oneOf(genDouble(),
                      rc::gen::map(rc::gen::inRange<int64_t>(-1'000'000'000'000, 1'000'000'000'000),
                                   [](int64_t n) { return static_cast<double>(n) / 999'983.0; }));
  RC_ASSERT(parseNumber(plusHalf(plusHalf(shortest(x)), -1)) == x);
}

// Against integers: n / 1000 + 1/2 = (n + 500) / 1000.
RC_GTEST_PROP(PlusHalf, AgreesWithIntegers, ()) {
  const long n = *rc::gen::inRange<long>(-2'000'000, 2'000'000);
  const auto thousandths = [](long k) {
    std::string digits = std::to_string(std::abs(k));
    digits.insert(0, digits.size() < 4 ? 4 - digits.size() : 0, '0');
    std::string text = k < 0 ? "-" : "";
    return text += digits.insert(digits.size() - 3, 1, '.');
  };
  RC_ASSERT(parseNumber(plusHalf(thousandths(n))) == parseNumber(thousandths(n + 500)));
  RC_ASSERT(parseNumber(plusHalf(thousandths(n), -1)) == parseNumber(thousandths(n - 500)));
}

TEST(Numbers, AreDecimalAndFinite) {
  EXPECT_EQ(parseNumber("1.5"), 1.5);
  EXPECT_EQ(parseNumber("+.5e1"), 5);
  EXPECT_EQ(parseNumber("-3."), -3);
  EXPECT_EQ(parseNumber("1.9097847715128717e+02"), 190.97847715128717);
  for (const std::string text : {"",
                                 "+",
                                 "-",
                                 "nan",
                                 "inf",
                                 "-inf",
                                 ".nan",
                                 "1e999",
                                 "1e-999",
                                 "0x10",
                                 "1,5",
                                 "1 ",
                                 " 1",
                                 "1.5f",
                                 "1e",
                                 "--1",
                                 "+-1"}) {
    EXPECT_EQ(parseNumber(text), std::nullopt) << text;
  }
  EXPECT_EQ(parseNumber("0." + std::string(900, '0') + "1e901"), 1);
  EXPECT_EQ(parseNumber(std::string(1001, '1')), std::nullopt);
}

RC_GTEST_PROP(Numbers, TextReadsBackAsTheSameDouble, ()) {
  const double x = *genDouble();
  RC_ASSERT(parseNumber(shortest(x)) == x);
  const std::string yaml = yamlNumber(x);
  RC_ASSERT(parseNumber(yaml) == x);
  RC_ASSERT(yaml.find('.') != std::string::npos);
}

TEST(Shown, IsOnePrintableLine) {
  EXPECT_EQ(shown("a\nb\tc\x01\xff"), "a?b?c??");
  EXPECT_EQ(shown(std::string(100, 'x')), std::string(60, 'x') + "...");
}

std::string refusal(const std::string& text,
                    Node (*parse)(const std::string&, const std::string&)) {
  try {
    (void)parse(text, "f");
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), StartsWith("f: "));
    return e.what();
  }
  return "accepted";
}
std::string yamlRefusal(const std::string& text) {
  return refusal(text, parseYaml);
}
std::string xmlRefusal(const std::string& text) {
  return refusal(text,
                 [](const std::string& t, const std::string& s) { return parseOpencvXml(t, s); });
}

/// One line per value, with its path.
std::string dump(const Node& node, const std::string& path = "") {
  std::string out;
  switch (node.kind) {
    case Node::Kind::kNull:
      return path + "=~\n";
    case Node::Kind::kScalar:
      return path + (node.quoted ? "=\"" : "=") + node.text + (node.quoted ? "\"\n" : "\n");
    case Node::Kind::kList:
      for (size_t i = 0; i < node.items.size(); ++i) {
        out += dump(node.items[i], path + "/" + std::to_string(i));
      }
      return out.empty() ? path + "=[]\n" : out;
    case Node::Kind::kMap:
      for (size_t i = 0; i < node.items.size(); ++i) {
        out += dump(node.items[i], path + "/" + node.keys.at(i));
      }
      return (node.opencv_matrix ? path + "=matrix\n" : "") + out;
  }
  return out;
}

TEST(Tree, IsTheSameFromYamlJsonAndXml) {
  const std::string expected =
      "/w=640\n/K=matrix\n/K/rows=1\n/K/data/0=1.\n/K/data/1=-2e3\n/s=\"a "
      "b\"\n/l/0=1\n/l/1=x\n/n=~\n";
  EXPECT_EQ(
      dump(parseYaml(
          "%YAML:1.0\n---\nw: 640 # c\nK: !!opencv-matrix\n   rows: 1\n   data: [ 1., -2e3 ]\n"
          "s: \"a b\"\nl: [1, x]\nn:\n",
          "f")),
      expected);
  EXPECT_EQ(
      dump(parseOpencvXml(
          "<?xml version=\"1.0\"?>\n<!-- c --><opencv_storage>\n<w>640</w><K "
          "type_id=\"opencv-matrix\">"
          "<rows>1</rows><data>\n 1. -2e3</data></K><s>\"a b\"</s><l><_>1</_><_>x</_></l><n></n>"
          "</opencv_storage>\n",
          "f")),
      expected);
  EXPECT_EQ(
      dump(parseYaml("{\"w\":640,\"K\":{\"rows\":1,\"data\":[1.,-2e3]},\n\t\"s\":\"a "
                     "b\",\"l\":[1,\"x\"],\"n\":null}",
                     "f")),
      "/w=640\n/K/rows=1\n/K/data/0=1.\n/K/data/1=-2e3\n/s=\"a b\"\n/l/0=1\n/l/1=\"x\"\n/n=~\n");
}

TEST(Tree, DuplicateKeysAreNamedWithTheirPlace) {
  EXPECT_THAT(yamlRefusal("a: 1\nb: {c: [0, {d: 1, e: 2, d: 3}]}\n"),
              HasSubstr("f: b.c[1].d is given twice, allowed is once"));
  EXPECT_THAT(yamlRefusal("{\"a\": 1, \"a\": 1}"), HasSubstr("a is given twice"));
  EXPECT_THAT(xmlRefusal("<opencv_storage><a>1</a><a>1</a></opencv_storage>"),
              HasSubstr("a is given twice"));
}

TEST(Tree, BrokenTextIsRefusedWithItsPlace) {
  EXPECT_THAT(yamlRefusal("a: [1, 2\n"),
              HasSubstr("not complete and correct YAML or JSON near line"));
  EXPECT_THAT(yamlRefusal("a: 1\n---\nb: 2\n"), HasSubstr("more than one YAML document"));
  EXPECT_THAT(yamlRefusal("---\n---\nb: 2\n"), HasSubstr("more than one YAML document"));
  EXPECT_THAT(yamlRefusal("a: 1\n---\n---\n- 1\n"), HasSubstr("more than one YAML document"));
  EXPECT_EQ(yamlRefusal("a: 1\n---\n"), "accepted");
  EXPECT_THAT(yamlRefusal("a: 1\n---\n---\n"), HasSubstr("more than one YAML document"));
  EXPECT_THAT(yamlRefusal("a: &x 1\nb: *x\n"), HasSubstr("anchor or alias"));
  EXPECT_THAT(yamlRefusal("a: *x\n"), HasSubstr("near line 1"));
  for (const std::string text :
       {"",
        "<",
        "<opencv_storage>",
        "<opencv_storage/>x",
        "<other></other>",
        "<opencv_storage><a>1</b></opencv_storage>",
        "<opencv_storage><a>1<b>2</b></a></opencv_storage>",
        "<opencv_storage><a><_>1</_><b>2</b></a></opencv_storage>",
        "<opencv_storage><a x=1>2</a></opencv_storage>",
        "<opencv_storage><a x=\"1>2</a></opencv_storage>",
        "<opencv_storage></opencv_storage><opencv_storage></opencv_storage>",
        "<opencv_storage><!-- </opencv_storage>",
        "<!DOCTYPE x [<!ENTITY a \"b\">]><opencv_storage></opencv_storage>",
        "<opencv_storage><![CDATA[x]]></opencv_storage>"}) {
    EXPECT_THAT(xmlRefusal(text), HasSubstr("not complete and correct XML of OpenCV near line"))
        << text;
  }
}

TEST(Tree, SizeAndDepthAreBounded) {
  const auto times = [](size_t n, const std::string& text) {
    std::string out;
    for (size_t i = 0; i < n; ++i) out += text;
    return out;
  };
  EXPECT_THAT(yamlRefusal("a: [" + times(kMaxNodes + 1, "1,") + "1]\n"),
              HasSubstr("more than 500000 values"));
  EXPECT_THAT(yamlRefusal("a: " + times(33, "[") + times(33, "]")),
              HasSubstr("deeper than 32 levels"));
  EXPECT_EQ(yamlRefusal("a: " + times(31, "[") + times(31, "]")), "accepted");
  EXPECT_THAT(yamlRefusal(times(20'000, "- ")), HasSubstr("deeper than 32 levels"));
  EXPECT_THAT(xmlRefusal("<opencv_storage>" + times(100'000, "<a>")),
              HasSubstr("deeper than 32 levels"));
  EXPECT_THAT(
      xmlRefusal("<opencv_storage><a>" + times(kMaxNodes + 1, "1 ") + "</a></opencv_storage>"),
      HasSubstr("more than 500000 values"));
}

}  // namespace
}  // namespace dlsd::calib
