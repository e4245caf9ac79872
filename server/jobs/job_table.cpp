#include "server/jobs/job_table.h"

#include <array>

#include "core/io/file_error.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

constexpr std::int64_t kSchemaVersion = 1;

using Row = JobTable::Row;
using Time = JobRecord::Time;
using std::chrono::microseconds;

std::int64_t numberOf(Time time) { return std::chrono::duration_cast<microseconds>(time.time_since_epoch()).count(); }
Time timeOf(std::int64_t number) { return Time(std::chrono::duration_cast<Time::duration>(microseconds(number))); }

/// One column: its declaration, and both ways between it and a row.
struct Column {
  const char* name;
  const char* declaration;
  void (*bind)(Statement&, int, const Row&);
  void (*read)(const Statement&, int, Row&);
};

template <auto Member>
Column text(const char* name) {
  return {name, "TEXT NOT NULL", [](Statement& s, int i, const Row& row) { s.bindText(i, row.record.*Member); },
          [](const Statement& s, int i, Row& row) { row.record.*Member = s.bytes(i); }};
}

template <auto Member>
Column integer(const char* name) {
  return {name, "INTEGER NOT NULL",
          [](Statement& s, int i, const Row& row) { s.bind(i, static_cast<std::int64_t>(row.record.*Member)); },
          [](const Statement& s, int i, Row& row) {
            using Value = std::remove_reference_t<decltype(row.record.*Member)>;
            row.record.*Member = static_cast<Value>(s.integer(i));
          }};
}

/// SQLite keeps NaN as NULL.
template <auto Member>
Column real(const char* name) {
  return {name, "REAL", [](Statement& s, int i, const Row& row) { s.bind(i, row.record.*Member); },
          [](const Statement& s, int i, Row& row) { row.record.*Member = s.real(i); }};
}

/// Microseconds since 1970.
template <auto Member>
Column time(const char* name) {
  return {name, "INTEGER",
          [](Statement& s, int i, const Row& row) {
            const auto& value = row.record.*Member;
            value ? s.bind(i, numberOf(*value)) : s.bindNull(i);
          },
          [](const Statement& s, int i, Row& row) {
            if (!s.isNull(i)) row.record.*Member = timeOf(s.integer(i));
          }};
}

/// A part of the result; NULL where there is none.
template <auto Get, class Value>
Column result(const char* name, const char* type) {
  return {name, type,
          [](Statement& s, int i, const Row& row) {
            if (!row.record.result) return s.bindNull(i);
            const auto value = static_cast<Value>(Get(const_cast<JobResult&>(*row.record.result)));
            s.bind(i, value);
          },
          [](const Statement& s, int i, Row& row) {
            if (s.isNull(i)) return;
            if (!row.record.result) row.record.result.emplace().model_name = row.record.model_name;
            auto& value = Get(*row.record.result);
            using Kept = std::remove_reference_t<decltype(value)>;
            if constexpr (std::is_same_v<Value, double>)
              value = s.real(i);
            else
              value = static_cast<Kept>(s.integer(i));
          }};
}

const std::vector<Column>& columns() {
  static const std::vector<Column> all{
      text<&JobRecord::key>("key"), text<&JobRecord::kind>("kind"),
      {"request", "BLOB NOT NULL", [](Statement& s, int i, const Row& row) { s.bindBytes(i, row.record.request); },
       [](const Statement& s, int i, Row& row) { row.record.request = s.bytes(i); }},
      {"request_id", "TEXT UNIQUE",
       [](Statement& s, int i, const Row& row) {
         row.record.request_id.empty() ? s.bindNull(i) : s.bindText(i, row.record.request_id);
       },
       [](const Statement& s, int i, Row& row) { row.record.request_id = s.bytes(i); }},
      {"owner", "TEXT NOT NULL", [](Statement& s, int i, const Row& row) { s.bindText(i, row.owner); },
       [](const Statement& s, int i, Row& row) { row.owner = s.bytes(i); }},
      text<&JobRecord::model_name>("model_name"), text<&JobRecord::dataset>("dataset"),
      integer<&JobRecord::state>("state"), integer<&JobRecord::cancel_requested>("cancel_requested"),
      text<&JobRecord::stage>("stage"), real<&JobRecord::fraction>("fraction"), real<&JobRecord::residual>("residual"),
      {"created", "INTEGER NOT NULL",
       [](Statement& s, int i, const Row& row) { s.bind(i, numberOf(row.record.created)); },
       [](const Statement& s, int i, Row& row) { row.record.created = timeOf(s.integer(i)); }},
      time<&JobRecord::started>("started"), time<&JobRecord::ended>("ended"), integer<&JobRecord::attempts>("attempts"),
      integer<&JobRecord::crashes>("crashes"), text<&JobRecord::resumed_from>("resumed_from"),
      result < [](JobResult & r) -> auto& {return r.model_version;
}
, std::int64_t > ("model_version", "INTEGER"), result < [](JobResult& r) -> auto& { return r.outcome.termination; }
, std::int64_t > ("termination", "INTEGER"), result < [](JobResult& r) -> auto& { return r.outcome.iterations; }
, std::int64_t > ("iterations", "INTEGER"), result < [](JobResult& r) -> auto& { return r.outcome.residual; }
, double > ("result_residual", "REAL"), result < [](JobResult& r) -> auto& { return r.seconds; }
, double > ("seconds", "REAL"), result < [](JobResult& r) -> auto& { return r.smallest_area_ratio; }
, double > ("smallest_area_ratio", "REAL"), text<&JobRecord::error>("error"),
    integer<&JobRecord::error_code>("error_code"),
};  // namespace
return all;
}  // namespace shaped::server

/// "key, kind, ..." with something behind each name.
std::string joined(const std::function<std::string(const Column&)>& what) {
  std::string all;
  for (const auto& column : columns()) all += (all.empty() ? "" : ", ") + what(column);
  return all;
}

std::string names() {
  return joined([](const Column& column) { return std::string(column.name); });
}

const std::string& selection() {
  static const std::string sql = "SELECT " + names() + ", number FROM jobs ";
  return sql;
}

int count() { return static_cast<int>(columns().size()); }

void bindAll(Statement& statement, const Row& row) {
  int at = 0;
  for (const auto& column : columns()) column.bind(statement, at++, row);
}

Row read(const Statement& statement) {
  Row row;
  int at = 0;
  for (const auto& column : columns()) column.read(statement, at++, row);
  row.record.id = std::to_string(statement.integer(at));
  return row;
}

/// 0, which is no job's number, for any other text.
std::int64_t numberOf(const std::string& id) {
  std::int64_t number = 0;
  return parseInteger(id, number) && std::to_string(number) == id ? number : 0;
}

std::int64_t oneNumber(Database& database, const std::string& sql) {
  Statement statement(database, sql);
  statement.step();
  return statement.integer(0);
}

void requireSound(Database& database) {
  Statement check(database, "PRAGMA quick_check(1)");
  check.step();
  if (const auto verdict = check.bytes(0); verdict != "ok")
    throw Corrupted(database.file() + ": is damaged (" + verdict +
                    "); restore it from a backup, or move it away together with " + database.file() +
                    "-wal and -shm: jobs are forgotten then, datasets and models stay");
}

std::string stateFilter(const JobQuery& query) {
  std::string states;
  for (const auto state : query.states)
    states += (states.empty() ? "" : ", ") + std::to_string(static_cast<int>(state));
  return states.empty() ? "" : "AND state IN (" + states + ") ";
}

}  // namespace

JobTable::JobTable(const std::filesystem::path& file) : database_(file) {
  // FULL: a job that a client was told of must outlive a power cut. A handful of writes a minute can afford it.
  database_.run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 100");
  requireSound(database_);
  prepareSchema();
}

void JobTable::prepareSchema() {
  const auto version = oneNumber(database_, "PRAGMA user_version");
  if (version == kSchemaVersion) return;
  if (version != 0)
    throw InvalidInput("--store", database_.file() + " has schema version " + std::to_string(version) +
                                      ", this daemon knows " + std::to_string(kSchemaVersion) +
                                      "; start the daemon that wrote it, or move the file away to forget its jobs");
  Transaction making(database_);
  database_.run("CREATE TABLE jobs (number INTEGER PRIMARY KEY AUTOINCREMENT, " +
                joined([](const Column& column) { return std::string(column.name) + " " + column.declaration; }) +
                ") STRICT");
  database_.run("CREATE INDEX jobs_by_state ON jobs (state, number)");
  database_.run("PRAGMA user_version = " + std::to_string(kSchemaVersion));
  making.commit();
}

void JobTable::write(const std::function<void()>& writing) {
  try {
    writing();
  } catch (const FileError&) {
    // The journal cannot grow. Moved into the database, which seldom grows, it is written again from its start.
    database_.run("PRAGMA wal_checkpoint(TRUNCATE)");
    writing();
  }
}

void JobTable::insert(Row& row) {
  std::string marks;
  for (int i = 0; i < count(); ++i) marks += i == 0 ? "?" : ", ?";
  write([&] {
    Statement insertion(database_, "INSERT INTO jobs (" + names() + ") VALUES (" + marks + ")");
    bindAll(insertion, row);
    insertion.step();
  });
  row.record.id = std::to_string(database_.lastRow());
}

void JobTable::save(const Row& row) {
  static const std::string sql = "UPDATE jobs SET " +
                                 joined([](const Column& column) { return std::string(column.name) + " = ?"; }) +
                                 " WHERE number = ?";
  write([&] {
    Statement change(database_, sql);
    bindAll(change, row);
    change.bind(count(), numberOf(row.record.id));
    change.step();
  });
}

void JobTable::erase(const std::string& id) {
  write([&] {
    Statement erasure(database_, "DELETE FROM jobs WHERE number = ?");
    erasure.bind(0, numberOf(id));
    erasure.step();
  });
}

std::optional<Row> JobTable::get(const std::string& id) {
  Statement search(database_, selection() + "WHERE number = ?");
  search.bind(0, numberOf(id));
  return search.step() ? std::optional(read(search)) : std::nullopt;
}

std::optional<Row> JobTable::find(const std::string& request_id) {
  Statement search(database_, selection() + "WHERE request_id = ?");
  search.bindText(0, request_id);
  return search.step() ? std::optional(read(search)) : std::nullopt;
}

std::vector<Row> JobTable::list(const JobQuery& query) {
  const auto after = numberOf(query.after);
  if (!query.after.empty() && after < 1) throw InvalidInput("page_token", quotedWord(query.after) + " is none of ours");
  Statement search(database_, selection() + "WHERE number > ? " + stateFilter(query) + "ORDER BY number LIMIT ?");
  search.bind(0, after);
  search.bind(1, static_cast<std::int64_t>(query.limit));
  std::vector<Row> rows;
  while (search.step()) rows.push_back(read(search));
  return rows;
}

std::vector<std::string> JobTable::old(std::size_t most, JobRecord::Time ended_before) {
  Statement search(database_,
                   "SELECT number FROM jobs WHERE ended IS NOT NULL AND (ended < ?1 OR number NOT IN (SELECT number "
                   "FROM jobs WHERE ended IS NOT NULL ORDER BY number DESC LIMIT ?2)) ORDER BY number");
  search.bind(0, numberOf(ended_before));
  search.bind(1, static_cast<std::int64_t>(most));
  std::vector<std::string> ids;
  while (search.step()) ids.push_back(std::to_string(search.integer(0)));
  return ids;
}

}  // namespace shaped::server
