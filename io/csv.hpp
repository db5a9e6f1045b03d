// Named columns of a CSV file (RFC 4180, first line the header) as numbers. The .cpp is the only file that names libcsv.
#pragma once

#include <string>
#include <vector>

namespace slipstream {

struct CsvTable {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> values;  // values[i] belongs to columns[i]; all of equal length, at least 1
  std::vector<long> line;                   // of each row in the file, counted from 1

  // The values of a column that was asked for.
  const std::vector<double>& operator[](const std::string& column) const;
};

// Reads `columns` of the file; other columns are not looked at. The column `increasing`, if named, must grow from row to row.
// Refuses, with file, line and column: a file that cannot be read or is malformed, a header without the column or with two of
// that name, a row with more or fewer cells than the header, a cell that is not a finite decimal number, a file without rows.
CsvTable read_csv(const std::string& path, const std::vector<std::string>& columns, const std::string& increasing = "");

}  // namespace slipstream
