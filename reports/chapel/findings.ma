//Maya ASCII 2018 scene
requires maya "2018";
currentUnit -l centimeter -a degree -t film;
createNode transform -n "clerestory_findings";
createNode transform -n "D1_geometry_missing" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	setAttr ".t" -type "double3" 12.0 3.553714 -4.693911 ;
	setAttr -k on ".note" -type "string" "something is there that is not modelled on “plaster”, 44 cm across; the real surface is 55.3 ± 6.0 cm nearer to the camera's side; not sure, because as much is off elsewhere in these pictures";
createNode locator -n "D1_geometry_missingShape" -p "D1_geometry_missing";
	setAttr ".los" -type "double3" 0.220912 0.220912 0.220912 ;
createNode transform -n "D2_geometry_missing" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	setAttr ".t" -type "double3" 12.0 0.361236 -5.0842 ;
	setAttr -k on ".note" -type "string" "something is there that is not modelled on “plaster”, 60 cm across; not sure, because as much is off elsewhere in these pictures";
createNode locator -n "D2_geometry_missingShape" -p "D2_geometry_missing";
	setAttr ".los" -type "double3" 0.301304 0.301304 0.301304 ;
// End of findings.ma
