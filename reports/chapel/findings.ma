//Maya ASCII 2018 scene
requires maya "2018";
currentUnit -l centimeter -a degree -t film;
createNode transform -n "clerestory_findings";
createNode transform -n "D1_texture_recoloured" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	setAttr ".t" -type "double3" 11.599999780749645 0.2587383773257801 1.9934153751056303 ;
	setAttr -k on ".note" -type "string" "the structure fits but the colour does not on “flag”, 34 cm across; not sure, because it is not clear which test is right";
createNode locator -n "D1_texture_recolouredShape" -p "D1_texture_recoloured";
	setAttr ".los" -type "double3" 0.17009609937667847 0.17009609937667847 0.17009609937667847 ;
// End of findings.ma
