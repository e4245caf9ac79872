#pragma once

#include <vector>

#include "server/jobs/job_registry.h"
#include "server/jobs/sqlite.h"

namespace shaped::server {

/// The rows of job records in a SQLite database. One thread at a time; throws as Database.
class JobTable {
 public:
  /// A record and the worker that has claimed it; empty: none.
  struct Row {
    JobRecord record;
    std::string owner;
  };

  /// Makes the table in a new database. Throws Corrupted when the file is damaged, InvalidInput naming "--store" when a
  /// later version of the program made it.
  explicit JobTable(const std::filesystem::path& file);

  /// Adds a record and gives it its id.
  void insert(Row& row);
  void save(const Row& row);
  void erase(const std::string& id);

  std::optional<Row> get(const std::string& id);
  std::optional<Row> find(const std::string& request_id);
  std::vector<Row> list(const JobQuery& query);
  /// Ids of ended jobs beyond the latest `most`, and of those that ended before a time.
  std::vector<std::string> old(std::size_t most, JobRecord::Time ended_before);

 private:
  void prepareSchema();
  /// Writes, and once more after it has made room in the journal where there was none.
  void write(const std::function<void()>& writing);

  Database database_;
};

}  // namespace shaped::server
