#include "cameras/calibration/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <functional>

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Files : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "dlsd-files-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }
  [[nodiscard]] size_t entries() const {
    return static_cast<size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

template <class Error>
std::string messageOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

TEST_F(Files, WhatWasWrittenIsRead) {
  for (const std::string& content :
       {std::string(), std::string("a\r\nb\0c", 6), std::string(300'000, 'x')}) {
    writeFileAtomically(path("a"), content);
    EXPECT_EQ(readFile(path("a")), content);
    EXPECT_EQ(entries(), 1U);
  }
}

TEST_F(Files, WritingReplacesTheWholeOldFile) {
  writeFileAtomically(path("a"), "a long old content");
  writeFileAtomically(path("a"), "new");
  EXPECT_EQ(readFile(path("a")), "new");
}

TEST_F(Files, NewFilesHaveTheUsualPermissions) {
  const mode_t mask = ::umask(022);
  writeFileAtomically(path("a"), "x");
  ::umask(mask);
  EXPECT_EQ(static_cast<int>(fs::status(path("a")).permissions()), 0644);
}

TEST_F(Files, ALinkStaysALink) {
  writeFileAtomically(path("real"), "old");
  fs::create_symlink("real", path("link"));
  writeFileAtomically(path("link"), "new");
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(readFile(path("real")), "new");
}

TEST_F(Files, ADeviceIsWrittenToAndNotReplaced) {
  writeFileAtomically("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(Files, WhatGrowsIsThereAfterCommitAndNotBefore) {
  writeFileAtomically(path("a"), "old");
  {
    AtomicFile file(path("a"));
    file.append("one ");
    EXPECT_EQ(entries(), 2U);
    EXPECT_EQ(readFile(path("a")), "old");
  }
  EXPECT_EQ(entries(), 1U);
  EXPECT_EQ(readFile(path("a")), "old");
  AtomicFile file(path("a"));
  for (const char* part : {"one ", "", "two"}) {
    file.append(part);
  }
  file.commit();
  EXPECT_EQ(readFile(path("a")), "one two");
  EXPECT_EQ(entries(), 1U);
  EXPECT_THAT(messageOf<SystemError>([&] { const AtomicFile none(path("nowhere/b")); }),
              AllOf(StartsWith(path("nowhere/b")), HasSubstr("No such file")));
}

TEST_F(Files, ReadingNamesFileAndReason) {
  EXPECT_THAT(messageOf<InputError>([&] { (void)readFile(path("absent")); }),
              AllOf(StartsWith(path("absent")), HasSubstr("No such file")));
  EXPECT_THAT(messageOf<InputError>([&] { (void)readFile(folder_.string()); }),
              AllOf(StartsWith(folder_.string()), HasSubstr("is a folder")));
  writeFileAtomically(path("file"), "x");
  EXPECT_THAT(messageOf<InputError>([&] { (void)readFile(path("file/below")); }),
              HasSubstr("Not a directory"));
}

TEST_F(Files, WritingNamesFileAndReasonAndLeavesNothing) {
  EXPECT_THAT(messageOf<SystemError>([&] { writeFileAtomically(path("no/such"), "x"); }),
              AllOf(StartsWith(path("no/such")), HasSubstr("No such file")));
  writeFileAtomically(path("file"), "x");
  EXPECT_THAT(messageOf<SystemError>([&] { writeFileAtomically(path("file/below"), "x"); }),
              HasSubstr("Not a directory"));
  fs::create_directory(path("folder"));
  EXPECT_THAT(messageOf<SystemError>([&] { writeFileAtomically(path("folder"), "x"); }),
              HasSubstr("Is a directory"));
  EXPECT_THAT(messageOf<SystemError>([&] { writeFileAtomically("/dev/full", "x"); }),
              HasSubstr("No space left"));
  EXPECT_EQ(entries(), 2U);
  EXPECT_EQ(readFile(path("file")), "x");
}

TEST_F(Files, AReadOnlyFolderRefuses) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THAT(messageOf<SystemError>([&] { writeFileAtomically(path("a"), "x"); }),
              HasSubstr("Permission denied"));
  fs::permissions(folder_, fs::perms::owner_all);
}

// The limit of the file size makes write() itself fail, for root as well.
TEST_F(Files, AFailingWriteKeepsTheOldFileAndRemovesTheTemporary) {
  writeFileAtomically(path("a"), "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message =
      messageOf<SystemError>([&] { writeFileAtomically(path("a"), std::string(100'000, 'x')); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(message, AllOf(StartsWith(path("a")), HasSubstr("File too large")));
  EXPECT_EQ(readFile(path("a")), "old");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(Files, FoldersAreMadeWithTheirParents) {
  makeFolders(path("a/b/c"));
  EXPECT_TRUE(fs::is_directory(path("a/b/c")));
  makeFolders(path("a/b/c"));
  makeFolders(path("a/b/c/"));
}

TEST_F(Files, AFileInTheWayOfAFolderIsNamed) {
  writeFileAtomically(path("file"), "x");
  EXPECT_THAT(messageOf<SystemError>([&] { makeFolders(path("file")); }),
              AllOf(StartsWith(path("file")), HasSubstr("Not a directory")));
  EXPECT_THAT(messageOf<SystemError>([&] { makeFolders(path("file/below")); }),
              HasSubstr("Not a directory"));
}

}  // namespace
}  // namespace dlsd
