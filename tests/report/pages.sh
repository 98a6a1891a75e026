#!/usr/bin/env bash
# pages.sh SOURCE BUILD: a fit's, a diagnosis's, a comparison's and a calibration's report in a real browser, as the
# tests write them: pages.mjs says what is looked at.
set -eu
source=$1 build=$2
export SELVEDGE_PAGES=$build/report-pages
rm -rf "$SELVEDGE_PAGES"
made() { # made TEST FILTER: the page that one test keeps
  "$build/bin/test_$1" --gtest_filter="$2" > "$build/report-pages.log" 2>&1 && return
  cat "$build/report-pages.log"
  exit 1
}
made fit FitCampaign.RecoversWhatTheTrialsDetermine
made diagnose Diagnosis.NamesADelayAndMeasuresIt
made station ComparisonTest.DrawsBothMapsOfTheFabricOnOneScale
made calib AfterCalibration.report_draws_and_stands_alone
made report FlippedPictures.StandInTheReportWithTheirNames
made exchange Exchange.ImportsMarkersWithOtherUnitsAndAxes
exec "$source/tests/console/browser.sh" "$build/bin/selvedge" "$source" "$build" pages.mjs
