//Maya ASCII 2018 scene
//Codeset: UTF-8
requires maya "2018";
currentUnit -l centimeter -a degree -t film;
createNode transform -n "clerestory_findings";
// End of findings.ma
