//Maya ASCII 2018 scene
requires maya "2018";
currentUnit -l centimeter -a degree -t film;
createNode transform -n "clerestory_findings";
createNode transform -n "D1_geometry_missing" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	setAttr ".t" -type "double3" 12.0 3.51633 -4.682826 ;
	setAttr -k on ".note" -type "string" "something is there that is not modelled on “plaster”, 47 cm across; the real surface is 54.1 ± 5.4 cm nearer to the camera's side; not sure, because as much is off elsewhere in these pictures";
createNode locator -n "D1_geometry_missingShape" -p "D1_geometry_missing";
	setAttr ".los" -type "double3" 0.237034 0.237034 0.237034 ;
createNode transform -n "D2_geometry_missing" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	setAttr ".t" -type "double3" 12.0 0.374027 -5.084154 ;
	setAttr -k on ".note" -type "string" "something is there that is not modelled on “plaster”, 63 cm across; not sure, because as much is off elsewhere in these pictures";
createNode locator -n "D2_geometry_missingShape" -p "D2_geometry_missing";
	setAttr ".los" -type "double3" 0.314925 0.314925 0.314925 ;
// End of findings.ma
