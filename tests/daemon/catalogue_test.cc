#include "daemon/catalogue.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>

#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

class CatalogueTest : public ::testing::Test {
 protected:
  testing::TemporaryDirectory root_;
  std::filesystem::path file_ = root_.path() / "catalogue.sqlite";
};

TEST_F(CatalogueTest, RemembersOverAReopening) {
  ASSERT_TRUE((*Catalogue::open(file_))->put({"a", "name", "/a", "2026-01-01", "running"}));

  const auto entry = (*Catalogue::open(file_))->find("a");

  ASSERT_TRUE(entry && *entry);
  EXPECT_EQ((*entry)->name, "name");
  EXPECT_EQ((*entry)->state, "running");
}

TEST_F(CatalogueTest, ListsTheNewestFirst) {
  const auto catalogue = *Catalogue::open(file_);
  for (const char* day : {"1", "3", "2"}) {
    ASSERT_TRUE(catalogue->put({day, "n", "/n", day, "queued"}));
  }
  const auto all = catalogue->list(2);

  ASSERT_TRUE(all);
  ASSERT_EQ(all->size(), 2U);
  EXPECT_EQ((*all)[0].id, "3");
  EXPECT_EQ((*all)[1].id, "2");
}

TEST_F(CatalogueTest, CountsTheSessionsOfEachState) {
  const auto catalogue = *Catalogue::open(file_);
  for (const char* id : {"a", "b", "c"})
    ASSERT_TRUE(catalogue->put({id, "n", "/n", "1", "failed"}));
  ASSERT_TRUE(catalogue->set_state("b", "running"));

  const auto counts = catalogue->counts();

  ASSERT_TRUE(counts);
  EXPECT_EQ(*counts, (std::map<std::string, std::int64_t>{{"failed", 2}, {"running", 1}}));
}

TEST_F(CatalogueTest, MakesAFileOfAnotherSchemaAnew) {
  sqlite3* database = nullptr;
  ASSERT_EQ(::sqlite3_open(file_.c_str(), &database), SQLITE_OK);
  const char* sql = "CREATE TABLE sessions (key TEXT); PRAGMA user_version = 7";
  ASSERT_EQ(::sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK);
  ::sqlite3_close(database);

  const auto catalogue = Catalogue::open(file_);

  ASSERT_TRUE(catalogue);
  EXPECT_TRUE((*catalogue)->put({"a", "n", "/n", "1", "failed"}));
  EXPECT_TRUE((*catalogue)->list(10));
}

TEST_F(CatalogueTest, TakesAnyTextForAValue) {
  const auto catalogue = *Catalogue::open(file_);
  const std::string nasty = "'); DROP TABLE sessions; --";
  ASSERT_TRUE(catalogue->put({nasty, nasty, nasty, nasty, nasty}));
  ASSERT_TRUE(catalogue->set_state(nasty, "over"));

  EXPECT_EQ((*catalogue->find(nasty))->state, "over");
  ASSERT_TRUE(catalogue->remove(nasty));
  EXPECT_FALSE(*catalogue->find(nasty));
}

TEST_F(CatalogueTest, SetsADamagedFileAside) {
  std::ofstream(file_) << std::string(5000, 'x');

  const auto catalogue = Catalogue::open(file_);

  ASSERT_TRUE(catalogue);
  EXPECT_TRUE((*catalogue)->list(10)->empty());
  EXPECT_TRUE(std::filesystem::exists(file_.string() + ".damaged"));
}

}  // namespace
}  // namespace opaline::daemon
